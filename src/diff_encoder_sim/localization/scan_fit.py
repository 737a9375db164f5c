"""Agreement of a scan with the map at a pose; upstream's amcl publishes poses that scans contradict."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, OccupancyGrid, distance_field

RAYS = 200  # about as many of a scan are checked
LEAST_RAYS = 10  # at obstacles of the map, for a decision

SHORT_WEIGHT = 0.25  # of rays that people and moved objects end; rays through obstacles of the map count 1

Pair = Tuple[float, float]

_OFF_MAP, _UNKNOWN, _CLEAR, _NEAR, _OCCUPIED = range(5)


class ScanFit(NamedTuple):
    """Numbers of rays of a scan by their end on the map, from a pose."""

    fitting: int  # close to an obstacle
    through: int  # behind an obstacle
    short: int  # before an obstacle

    @property
    def fraction(self) -> Optional[float]:
        """Fraction of the rays that fit, 0 to 1; None with too few rays."""
        if self.fitting + self.through + self.short < LEAST_RAYS:
            return None
        return self.fitting / (self.fitting + self.through + SHORT_WEIGHT * self.short)


class FitMap:
    """A map prepared for counting the rays that fit it."""

    def __init__(self, grid: OccupancyGrid, distance_m: float) -> None:
        """Prepare a map; a ray fits if it ends within `distance_m` of the centre of an occupied cell."""
        self._grid, self._distance_m = grid, distance_m
        is_occupied = grid.cells == OCCUPIED
        field = distance_field(is_occupied, grid.resolution_m, 2.0 * distance_m)
        self._kinds = np.full(grid.cells.shape, _UNKNOWN, np.int8)
        self._kinds[(grid.cells >= 0) & (grid.cells <= OCCUPIED)] = _CLEAR
        self._kinds[(field.distances_m <= distance_m)[field.indices]] = _NEAR
        self._kinds[is_occupied] = _OCCUPIED

    def fit(self, base_pose_in_map: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> ScanFit:
        """Classify a scan's valid rays, also beyond laser_max_range: longer rays distinguish places better."""
        base, cell_m = base_pose_in_map.relative_to(self._grid.origin), self._grid.resolution_m
        laser, step = base.compose(laser_pose_in_base), max(1, len(scan.ranges_m) // RAYS)
        place = (laser.x_m / cell_m, laser.y_m / cell_m), (base.yaw_rad, laser_pose_in_base.yaw_rad)
        return ScanFit(*_sort_rays(scan, step, *place, cell_m, self._distance_m / cell_m, self._kinds))


@compiled
def _sort_rays(
    scan: Scan, every: int, laser: Pair, yaws_rad: Pair, cell_m: float, distance: float, kinds: Array
) -> Tuple[int, int, int]:
    """Count rays as fitting, through, short; lengths in cells of the grid; yaws of the base, and the laser in it."""
    (x, y), (base_yaw_rad, laser_yaw_rad), step_rad = laser, yaws_rad, scan.angle_increment_rad * every
    fitting = through = short = 0
    for j in range((len(scan.ranges_m) + every - 1) // every):
        range_m = scan.ranges_m[j * every]
        if not max(scan.range_min_m, 0.0) < range_m < scan.range_max_m or range_m == math.inf:
            continue
        direction_rad = base_yaw_rad + (laser_yaw_rad + (scan.angle_min_rad + step_rad * j))
        cos_direction, sin_direction, length = math.cos(direction_rad), math.sin(direction_rad), range_m / cell_m
        end = _kind_at(kinds, x + length * cos_direction, y + length * sin_direction)
        if end >= _NEAR:
            fitting += 1
            continue
        is_blocked, first = False, _distance_to_map(x, y, cos_direction, sin_direction, length, kinds.shape)
        # Steps of half a cell skip at most a corner of a cell.
        for step in range(1 + int(2.0 * first), int(2.0 * (length - distance))):
            kind = _kind_at(kinds, x + 0.5 * step * cos_direction, y + 0.5 * step * sin_direction)
            is_blocked = kind == _OCCUPIED
            if is_blocked or kind == _OFF_MAP:
                break
        if is_blocked:
            through += 1
        elif end == _CLEAR:
            short += 1
    return fitting, through, short


@compiled
def _distance_to_map(
    x: float, y: float, cos_direction: float, sin_direction: float, length: float, shape: Tuple[int, int]
) -> float:
    """Return the distance along a ray to the map: 0 for a laser on it, `length` if never."""
    enter, leave = 0.0, length
    for start, slope, size in ((x, cos_direction, float(shape[1])), (y, sin_direction, float(shape[0]))):
        if slope != 0.0:
            enter = max(enter, min(-start / slope, (size - start) / slope))
            leave = min(leave, max(-start / slope, (size - start) / slope))
        elif start < 0.0 or start >= size:
            return length
    return enter if enter < leave else length


@compiled
def _kind_at(kinds: Array, x: float, y: float) -> int:
    column, row = int(math.floor(x)), int(math.floor(y))
    is_on_map = 0 <= row < kinds.shape[0] and 0 <= column < kinds.shape[1]
    return int(kinds[row, column]) if is_on_map else _OFF_MAP


class LostDetector:
    """Lost after lost_scans consecutive bad scans, found after as many good ones.

    A wrong pose near by may fit half of a scan: the threshold for found is halfway from lost_fraction to 1.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._map = FitMap(grid, params.lost_distance) if params.lost_fraction > 0.0 else None
        self._lost_fraction, self._lost_scans = params.lost_fraction, params.lost_scans
        self.is_lost = False
        self.fit_fraction: Optional[float] = None  # of the newest scan with enough rays
        self._against = 0  # consecutive scans that contradict is_lost

    def check(self, base_pose_in_map: Pose2D, scan: Scan, laser_pose_in_base: Pose2D, may_be_found: bool) -> None:
        """Compare a scan with the map at the filter's estimate, and update is_lost.

        Rays without a return and off the map are ignored; `may_be_found` is False while the pose is not determined.
        """
        fraction = self._map.fit(base_pose_in_map, scan, laser_pose_in_base).fraction if self._map else None
        if fraction is None:
            return
        self.fit_fraction = fraction
        least_fraction = 0.5 * (self._lost_fraction + 1.0) if self.is_lost else self._lost_fraction
        is_good = fraction >= least_fraction and (may_be_found or not self.is_lost)
        self._against = self._against + 1 if is_good == self.is_lost else 0
        if self._against >= self._lost_scans:
            self.is_lost, self._against = not self.is_lost, 0

    def declare_lost(self) -> None:
        """Set the robot as lost until scans fit."""
        self.is_lost, self._against = self._map is not None, 0

    def restart_count(self) -> None:
        """Drop the previous scans, which were compared with another estimate."""
        self._against = 0
