"""The rays of a scan that weigh the particles: a subset, in the base frame, within limits.

Also the checks that a scan must pass before it is used.
"""

from __future__ import annotations

import abc
import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid


class Beams(NamedTuple):
    """Rays in the base frame; a range of `range_max_m` stands for no return."""

    ranges_m: np.ndarray  # (k,), 0 to range_max_m
    bearings_rad: np.ndarray  # (k,) in the base frame
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float
    range_max_m: float

    def endpoints_in_base(self) -> np.ndarray:
        """Return (k, 2) x, y [m] of the rays' ends."""
        return np.column_stack(
            [
                self.laser_x_m + self.ranges_m * np.cos(self.bearings_rad),
                self.laser_y_m + self.ranges_m * np.sin(self.bearings_rad),
            ]
        )


def beam_step(ray_count: int, max_beams: int) -> int:
    """Return the step between rays that count, rounded down as upstream: 180 of 1000 are 200."""
    return max(1, (ray_count - 1) // (max_beams - 1))


def beam_step_rounded_up(ray_count: int, max_beams: int) -> int:
    """Return the step as upstream's likelihood_field_prob: never more than `max_beams` rays."""
    return math.ceil(ray_count / max_beams)


def select_beams(scan: Scan, step: int, laser_pose_in_base: Pose2D, params: AmclParams, hits_only: bool) -> Beams:
    """Select each step-th ray that is a number, or of those only the rays that returned.

    Readings at or below the least range become no return, as upstream treats them; so do those
    at or beyond the largest, infinity included.

    Raises:
        InputFault: the scan has an invalid range limit.
    """
    range_min_m, range_max_m = _range_limits_m(scan, params)
    # A copy, whatever the scan's array is like: the kernel is compiled for one kind of array.
    ranges_m, bearings_rad = _rays_in_base(
        np.array(scan.ranges_m[::step], dtype=float),
        range_min_m,
        range_max_m,
        hits_only,
        scan.angle_min_rad,
        scan.angle_increment_rad * step,
        laser_pose_in_base.yaw_rad,
    )
    return Beams(ranges_m, bearings_rad, laser_pose_in_base.x_m, laser_pose_in_base.y_m, range_max_m)


def _range_limits_m(scan: Scan, params: AmclParams) -> Tuple[float, float]:
    """Return the least and the largest range that count [m], or raise InputFault."""
    range_max_m, range_min_m = float(scan.range_max_m), float(scan.range_min_m)
    if params.laser_max_range > 0.0:
        range_max_m = min(range_max_m, params.laser_max_range)
    if params.laser_min_range > 0.0:
        range_min_m = max(range_min_m, params.laser_min_range)
    if not (0.0 < range_max_m < math.inf):
        raise InputFault(f'range_max {range_max_m} m; expected a finite number greater than 0')
    if not (0.0 <= range_min_m < math.inf):
        raise InputFault(f'range_min {range_min_m} m; expected a finite number of at least 0')
    return range_min_m, range_max_m


@compiled
def _rays_in_base(
    ranges_m: Array,
    range_min_m: float,
    range_max_m: float,
    hits_only: bool,
    first_rad: float,
    step_rad: float,
    laser_yaw_rad: float,
) -> Tuple[np.ndarray, np.ndarray]:
    """Return (k,) ranges and (k,) bearings in the base frame of the rays (n,) that are numbers."""
    kept_m, bearings_rad = np.empty(len(ranges_m)), np.empty(len(ranges_m))
    count = 0
    for ray in range(len(ranges_m)):
        range_m = ranges_m[ray]
        if range_m <= range_min_m or range_m > range_max_m:
            range_m = range_max_m
        if math.isnan(range_m) or (hits_only and range_m >= range_max_m):
            continue
        kept_m[count] = range_m
        bearings_rad[count] = laser_yaw_rad + (first_rad + step_rad * ray)
        count += 1
    return kept_m[:count], bearings_rad[:count]


def check_scan(scan: Scan) -> None:
    """Refuse a scan without rays or without a direction for each.

    Raises:
        InputFault: no rays, bearings that are not finite, or all rays in one direction.
    """
    if np.ndim(scan.ranges_m) != 1 or len(scan.ranges_m) == 0:
        raise InputFault(f'{np.size(scan.ranges_m)} ranges; expected at least one')
    if not math.isfinite(scan.angle_min_rad + scan.angle_increment_rad * len(scan.ranges_m)):
        raise InputFault(
            f'angle_min {scan.angle_min_rad}, angle_increment {scan.angle_increment_rad} rad; expected finite numbers'
        )
    if len(scan.ranges_m) > 1 and scan.angle_increment_rad == 0.0:
        raise InputFault(
            f'angle_increment 0 with {len(scan.ranges_m)} ranges; expected each ray in a direction of its own'
        )


def no_return_fault(scan: Scan, beams: Beams) -> InputFault:
    """Return the error for a scan without a return in any of the rays used."""
    return InputFault(
        f'none of {len(scan.ranges_m)} rays, as far as they are used, has a return within {beams.range_max_m:g} m: '
        'it cannot localize the robot'
    )


class Likelihoods(NamedTuple):
    """The likelihood of a scan for each particle: factors[i] * exp(log_scale).

    In two parts, because a product over 180 beams need not fit a double.
    """

    factors: np.ndarray  # (n,), 0 or more
    log_scale: float


class SensorModel(abc.ABC):
    """A laser model on one map."""

    # The likelihood fields ignore rays without a return.
    _hits_only = True

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._params = params
        self._grid = grid

    def beams(self, scan: Scan, laser_pose_in_base: Pose2D) -> Beams:
        """Select the rays of a scan that count.

        Raises:
            InputFault: none does, or the scan is invalid.
        """
        check_scan(scan)
        beams = select_beams(scan, self._step(len(scan.ranges_m)), laser_pose_in_base, self._params, self._hits_only)
        if len(beams.ranges_m) == 0:
            raise no_return_fault(scan, beams)
        return beams

    def _step(self, ray_count: int) -> int:
        """Return the step between the rays that count."""
        return beam_step(ray_count, self._params.laser_max_beams)

    @abc.abstractmethod
    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3), base poses in the map, by a scan's beams.

        Args:
            particles: x [m], y [m], yaw [rad].
            beams: from `beams`.
            converged: whether the particles lie close together.
        """

    def _poses_in_cells(self, particles: np.ndarray) -> np.ndarray:
        """Return (n, 4): particles as column, row (with fractions), cosine and sine in the grid's frame.

        Cell (row, column) covers [column, column + 1) x [row, row + 1), as nav_msgs/OccupancyGrid
        means it. Upstream rounds to the nearest cell instead, which puts its map half a cell off,
        and leaves out the origin's yaw.
        """
        origin, cell_m = self._grid.origin, self._grid.resolution_m
        cos_origin, sin_origin = np.cos(origin.yaw_rad), np.sin(origin.yaw_rad)
        x_m, y_m = particles[:, 0] - origin.x_m, particles[:, 1] - origin.y_m
        yaw_rad = particles[:, 2] - origin.yaw_rad
        columns = (cos_origin * x_m + sin_origin * y_m) / cell_m
        rows = (cos_origin * y_m - sin_origin * x_m) / cell_m
        return np.column_stack([columns, rows, np.cos(yaw_rad), np.sin(yaw_rad)])
