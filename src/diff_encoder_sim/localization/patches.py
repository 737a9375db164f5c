"""The maps of all particles: a table of patches for each, which are shared until one particle writes."""

from __future__ import annotations

import math
from typing import NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.laser_models import check_scan
from diff_encoder_sim.localization.slam_params import MOST_ENTRIES, SIDE, GridSlamParams, patches_along

SHIFT, MASK = 5, SIDE - 1
HITS, VISITS, MEAN_X, MEAN_Y = range(4)  # the numbers of a cell
EMPTY = 0  # the patch of unseen cells, which stays empty
FIRST_CAPACITY = 256  # patches
ENLARGE_M = 10.0  # a map grows by this much more than needed: upstream's
RANGE_MARGIN_M = 0.01  # upstream's, below the scan's own limit without maxRange


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
        x_m, y_m = self.laser_x_m + lengths_m * np.cos(bearings_rad), self.laser_y_m + lengths_m * np.sin(bearings_rad)
        return np.column_stack([x_m, y_m])

    def reach_m(self) -> float:
        """Return an upper bound [m] of the ends' distance from the base."""
        return math.hypot(self.laser_x_m, self.laser_y_m) + float(self.lengths_m.max(initial=0.0))


def usable_rays(scan: Scan, laser_pose_in_base: Pose2D, params: GridSlamParams) -> Rays:
    """Sort a scan's rays as upstream does; raise InputFault if it has no rays, no directions or no range limit.

    A ray beyond maxRange is ignored; one beyond maxUrange shows that cells up to there are free. +inf (nothing within
    range_max, REP-117) counts as a reading of range_max: free space appears in the open if maxUrange < range_max <=
    maxRange, as upstream's manual describes. Upstream reads too short ranges as range_max; here they are ignored.
    """
    range_max_m = float(scan.range_max_m)
    check_scan(scan, range_max_m)
    max_range_m = params.maxRange or range_max_m - RANGE_MARGIN_M
    usable_m = min(params.maxUrange or max_range_m, max_range_m)
    ranges_m = np.asarray(scan.ranges_m, dtype=float)
    ranges_m = np.where(ranges_m == math.inf, range_max_m, ranges_m)
    with np.errstate(invalid='ignore'):  # NaN compares as false
        is_used = (ranges_m > 0.0) & (ranges_m >= scan.range_min_m) & (ranges_m <= max_range_m)
        is_hit = is_used & (ranges_m < usable_m) & (ranges_m < range_max_m)
    is_matched = is_hit & (np.arange(len(ranges_m)) % (params.lskip + 1) == 0)
    bearings_rad = laser_pose_in_base.yaw_rad + scan.bearings_rad()[is_used]
    lengths_m = np.minimum(ranges_m[is_used], usable_m)
    return Rays(bearings_rad, lengths_m, is_hit[is_used], is_matched[is_used], *laser_pose_in_base[:2])


class PatchMaps:
    """One grid per particle.

    Attributes:
        cells: (capacity, SIDE, SIDE, 4) float32, a patch's cells: rays that ended in it, that ended in or passed it
            (up to 2^24), and the mean of the ends, from the cell's corner, in cells.
        table: (particles, rows, columns) int32, where in `cells` a particle's patches are.
        references: (capacity,) int32, how many entries of `table` name a patch.
        free: (capacity,) int32, patches in no table, the first `free_count[0]` of them.
    """

    def __init__(self, low_m: Sequence[float], high_m: Sequence[float], cell_m: float, particle_count: int) -> None:
        """Start with empty maps between two corners x, y [m]."""
        self.cell_m = cell_m
        self.corner_m = np.array(low_m, dtype=float)  # of the first cell
        columns, rows = (patches_along(high - low, cell_m) for low, high in zip(low_m, high_m))
        self.table = np.zeros((particle_count, rows, columns), np.int32)
        self.cells = np.zeros((FIRST_CAPACITY, SIDE, SIDE, 4), np.float32)
        self.references = np.zeros(FIRST_CAPACITY, np.int32)
        self._find_free()

    def _find_free(self) -> None:
        found = np.flatnonzero(self.references[1:] == 0)[::-1] + 1
        self.free = np.zeros(len(self.references), np.int32)
        self.free[: len(found)], self.free_count = found, np.array([len(found)], np.int64)

    def ensure_free(self, count: int) -> None:
        """Make sure that `count` patches are free; capacity doubles where they are not."""
        before = capacity = len(self.references)
        missing = count - int(self.free_count[0])
        if missing <= 0:
            return
        while capacity < before + missing:
            capacity *= 2
        # Zeros that are never written take no memory.
        cells, references = np.zeros((capacity, *self.cells.shape[1:]), np.float32), np.zeros(capacity, np.int32)
        np.copyto(cells[:before], self.cells, where=(self.references > 0)[:, None, None, None])
        references[:before] = self.references
        self.cells, self.references = cells, references
        self._find_free()

    def cover(self, low_m: np.ndarray, high_m: np.ndarray) -> None:
        """Grow to the rectangle between two corners (2,) x, y [m]; InputFault, without effect, if it is too large."""
        patch_m, size = SIDE * self.cell_m, np.array(self.table.shape[:0:-1])
        missing_m = np.array([self.corner_m - low_m, high_m - self.corner_m - size * patch_m])
        if not (missing_m > 0.0).any():
            return
        before, after = np.where(missing_m > 0.0, np.ceil((missing_m + ENLARGE_M) / patch_m), 0.0).astype(int)
        if len(self.table) * (before + size + after).prod() > MOST_ENTRIES:
            raise InputFault(
                f'the map would have to reach from {low_m[0]:.0f} to {high_m[0]:.0f} m along x and '
                f'from {low_m[1]:.0f} to {high_m[1]:.0f} m along y: too large'
            )
        self.table = np.pad(self.table, ((0, 0), (before[1], after[1]), (before[0], after[0])))
        self.corner_m = self.corner_m - before * patch_m

    def resample(self, indices: np.ndarray) -> None:
        """Give particle i the map of particle `indices[i]`; nothing but tables is copied."""
        self.table = self.table[indices]
        self.references = np.bincount(self.table.ravel(), minlength=len(self.references)).astype(np.int32)
        self.references[EMPTY] = 0
        self._find_free()

    def counts(self, particle: int) -> Tuple[np.ndarray, np.ndarray, int, int]:
        """Return hits and visits (height, width) float32 of the patches that a particle has seen, and their corner."""
        row, column = np.nonzero(self.table[particle])
        top, left = int(row.min(initial=self.table.size)), int(column.min(initial=self.table.size))
        rows, columns = max(0, int(row.max(initial=-1)) + 1 - top), max(0, int(column.max(initial=-1)) + 1 - left)
        patches = self.cells[self.table[particle, top : top + rows, left : left + columns], :, :, :2]
        hits, visits = patches.transpose(4, 0, 2, 1, 3).reshape(2, rows * SIDE, columns * SIDE)
        return hits, visits, top * SIDE, left * SIDE

    def update(self, particles: np.ndarray, rays: Rays) -> None:
        """Enter a scan, taken at each particle's pose (n, 3), into its map; the maps cover all that the rays reach."""
        # The most patches that one particle may have to make its own: all around the robot.
        across = 2 * math.ceil(rays.reach_m() / (SIDE * self.cell_m)) + 2
        lengths, (corner_x_m, corner_y_m) = rays.lengths_m / self.cell_m, self.corner_m.tolist()
        for table, (x_m, y_m, yaw_rad) in zip(self.table, particles.tolist()):
            self.ensure_free(min(across * across, table.size))
            cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
            laser_x = (x_m + cos_yaw * rays.laser_x_m - sin_yaw * rays.laser_y_m - corner_x_m) / self.cell_m
            laser_y = (y_m + sin_yaw * rays.laser_x_m + cos_yaw * rays.laser_y_m - corner_y_m) / self.cell_m
            directions_rad = yaw_rad + rays.bearings_rad
            slopes = np.cos(directions_rad), np.sin(directions_rad)
            patches = self.cells, self.references, self.free, self.free_count
            _update_map(table, patches, (laser_x, laser_y), *slopes, lengths, rays.is_hit)


Patches = Tuple[Array, Array, Array, Array]  # of `PatchMaps`: cells, references, free and free_count
Point = Tuple[float, float]


@compiled
def _update_map(
    table: Array, patches: Patches, laser: Point, cosines: Array, sines: Array, lengths: Array, is_hit: Array
) -> None:
    """Enter a scan into one particle's map; lengths in cells, from the map's corner."""
    (laser_x, laser_y), cells = laser, patches[0]
    patch_row = patch_column = patch = -1
    for j in range(len(lengths)):
        end_x, end_y = laser_x + lengths[j] * cosines[j], laser_y + lengths[j] * sines[j]
        column, row = int(math.floor(laser_x)), int(math.floor(laser_y))
        last_column, last_row = int(math.floor(end_x)), int(math.floor(end_y))
        step_x, next_x, period_x = _first_border(laser_x, cosines[j])
        step_y, next_y, period_y = _first_border(laser_y, sines[j])
        # As many steps as cell borders, however the distances are rounded.
        for _ in range(abs(last_column - column) + abs(last_row - row) + 1):
            is_last = column == last_column and row == last_row
            if (row >> SHIFT) != patch_row or (column >> SHIFT) != patch_column:
                patch_row, patch_column = row >> SHIFT, column >> SHIFT
                patch = _own_patch(table, patch_row, patch_column, patches)
            if is_last and is_hit[j]:
                cell = cells[patch, row & MASK, column & MASK]
                cell[HITS] += np.float32(1.0)
                cell[VISITS] += np.float32(1.0)
                cell[MEAN_X] += np.float32((end_x - column - cell[MEAN_X]) / cell[HITS])
                cell[MEAN_Y] += np.float32((end_y - row - cell[MEAN_Y]) / cell[HITS])
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
def _own_patch(table: Array, row: int, column: int, patches: Patches) -> int:
    """Return the patch at a place of one particle's table, copied if others share it; one must be free."""
    cells, references, free, free_count = patches
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
