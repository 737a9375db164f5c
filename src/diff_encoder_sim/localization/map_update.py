"""The map update: counts the cells that a scan's rays pass and those in which they end."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.beams import check_range_max, check_scan
from diff_encoder_sim.localization.patches import EMPTY, HITS, MASK, MEAN_X, MEAN_Y, SHIFT, SIDE, VISITS, PatchMaps
from diff_encoder_sim.localization.slam_params import GridSlamParams

# Upstream's margin below the scan's own limit, where maxRange is not given [m].
RANGE_MARGIN_M = 0.01


class Rays(NamedTuple):
    """The usable rays of one scan, in the base frame."""

    bearings_rad: np.ndarray  # (n,)
    lengths_m: np.ndarray  # (n,) to the end, or to where they are cut
    is_hit: np.ndarray  # (n,) bool: an obstacle is at the end
    is_matched: np.ndarray  # (n,) bool: hits that scan matching uses
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float

    def matched_ends_m(self) -> np.ndarray:
        """Return (k, 2) x, y [m] in the base frame of the ends to match."""
        bearings_rad, lengths_m = self.bearings_rad[self.is_matched], self.lengths_m[self.is_matched]
        x_m = self.laser_x_m + lengths_m * np.cos(bearings_rad)
        y_m = self.laser_y_m + lengths_m * np.sin(bearings_rad)
        return np.column_stack([x_m, y_m])

    def reach_m(self) -> float:
        """Return an upper bound [m] of the ends' distance from the base."""
        longest_m = float(self.lengths_m.max()) if len(self.lengths_m) else 0.0
        return math.hypot(self.laser_x_m, self.laser_y_m) + longest_m


def usable_rays(scan: Scan, laser_pose_in_base: Pose2D, params: GridSlamParams) -> Rays:
    """Sort a scan's rays as upstream does.

    A ray beyond maxRange is ignored; one beyond maxUrange shows that all up to there is free. +inf
    (nothing within range_max, REP-117) counts as a reading of range_max: so free space appears in
    the open where maxUrange < range_max <= maxRange, as upstream's manual describes. Upstream
    reads a range that is too close to measure as range_max; here it is ignored.

    Raises:
        InputFault: the scan has no rays, no directions or no range limit.
    """
    check_scan(scan)
    range_max_m = float(scan.range_max_m)
    check_range_max(range_max_m)
    max_range_m = params.maxRange or range_max_m - RANGE_MARGIN_M
    usable_m = min(params.maxUrange or max_range_m, max_range_m)
    ranges_m = np.asarray(scan.ranges_m, dtype=float)
    ranges_m = np.where(ranges_m == math.inf, range_max_m, ranges_m)
    # NaN compares as false.
    with np.errstate(invalid='ignore'):
        is_used = (ranges_m > 0.0) & (ranges_m >= scan.range_min_m) & (ranges_m <= max_range_m)
        is_hit = is_used & (ranges_m < usable_m) & (ranges_m < range_max_m)
    is_matched = is_hit & (np.arange(len(ranges_m)) % (params.lskip + 1) == 0)
    bearings_rad = laser_pose_in_base.yaw_rad + scan.bearings_rad()[is_used]
    lengths_m = np.minimum(ranges_m[is_used], usable_m)
    laser_m = laser_pose_in_base.x_m, laser_pose_in_base.y_m
    return Rays(bearings_rad, lengths_m, is_hit[is_used], is_matched[is_used], *laser_m)


def update_maps(maps: PatchMaps, particles: np.ndarray, rays: Rays) -> None:
    """Enter a scan into every particle's map, taken from its pose.

    Args:
        maps: covers all that the rays reach.
        particles: (n, 3) base poses in the map.
        rays: the scan's.
    """
    # The most patches that one particle may have to make its own: all about the robot.
    across = 2 * math.ceil(rays.reach_m() / (SIDE * maps.cell_m)) + 2
    lengths = rays.lengths_m / maps.cell_m
    for table, (x_m, y_m, yaw_rad) in zip(maps.table, particles.tolist()):
        maps.ensure_free(min(across * across, table.size))
        cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
        laser_x = (x_m + cos_yaw * rays.laser_x_m - sin_yaw * rays.laser_y_m - maps.origin_x_m) / maps.cell_m
        laser_y = (y_m + sin_yaw * rays.laser_x_m + cos_yaw * rays.laser_y_m - maps.origin_y_m) / maps.cell_m
        directions_rad = yaw_rad + rays.bearings_rad
        cosines, sines = np.cos(directions_rad), np.sin(directions_rad)
        patches = maps.cells, maps.references, maps.free, maps.free_count
        _update_map(table, *patches, laser_x, laser_y, cosines, sines, lengths, rays.is_hit)


@compiled
def _update_map(
    table: Array,
    cells: Array,
    references: Array,
    free: Array,
    free_count: Array,
    laser_x: float,
    laser_y: float,
    cosines: Array,
    sines: Array,
    lengths: Array,
    is_hit: Array,
) -> None:
    """Enter a scan into one particle's map; lengths in cells, from the map's corner."""
    patch_row, patch_column, patch = -1, -1, -1
    for j in range(len(lengths)):
        end_x = laser_x + lengths[j] * cosines[j]
        end_y = laser_y + lengths[j] * sines[j]
        column, row = int(math.floor(laser_x)), int(math.floor(laser_y))
        last_column, last_row = int(math.floor(end_x)), int(math.floor(end_y))
        step_x, next_x, period_x = _first_border(laser_x, cosines[j])
        step_y, next_y, period_y = _first_border(laser_y, sines[j])
        # As many steps as there are cell borders between, however the distances are rounded.
        for _ in range(abs(last_column - column) + abs(last_row - row) + 1):
            is_last = column == last_column and row == last_row
            if (row >> SHIFT) != patch_row or (column >> SHIFT) != patch_column:
                patch_row, patch_column = row >> SHIFT, column >> SHIFT
                patch = _own_patch(table, patch_row, patch_column, cells, references, free, free_count)
            if is_last and is_hit[j]:
                _hit(cells[patch, row & MASK, column & MASK], end_x - column, end_y - row)
            elif not is_last:
                cells[patch, row & MASK, column & MASK, VISITS] += np.float32(1.0)
            if (next_x < next_y and column != last_column) or row == last_row:
                column += step_x
                next_x += period_x
            else:
                row += step_y
                next_y += period_y


@compiled
def _first_border(start: float, slope: float) -> Tuple[int, float, float]:
    """Return, for one axis: step, distance along the ray to the first cell border, and between two."""
    if slope > 0.0:
        return 1, (math.floor(start) + 1.0 - start) / slope, 1.0 / slope
    if slope < 0.0:
        return -1, (math.floor(start) - start) / slope, -1.0 / slope
    return 0, math.inf, math.inf


@compiled
def _hit(cell: Array, x: float, y: float) -> None:
    cell[HITS] += np.float32(1.0)
    cell[VISITS] += np.float32(1.0)
    cell[MEAN_X] += np.float32((x - cell[MEAN_X]) / cell[HITS])
    cell[MEAN_Y] += np.float32((y - cell[MEAN_Y]) / cell[HITS])


@compiled
def _own_patch(
    table: Array, row: int, column: int, cells: Array, references: Array, free: Array, free_count: Array
) -> int:
    """Return the patch at a place of one particle's table, made its own; one must be free."""
    patch = int(table[row, column])
    if patch != EMPTY and references[patch] == 1:
        return patch
    free_count[0] -= 1
    own = int(free[free_count[0]])
    if patch == EMPTY:
        cells[own] = 0.0
    else:
        cells[own] = cells[patch]
        references[patch] -= 1
    references[own] = 1
    table[row, column] = own
    return own
