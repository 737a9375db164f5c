"""The maps of all particles: patches of cells, shared until one particle writes (copy on write).

Each particle has a table of patches; a patch that several tables name is copied before one of them
changes it. So cells that particles have in common are in memory once.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault

SIDE = 32  # cells along a patch; a power of two
SHIFT, MASK = 5, SIDE - 1

# The numbers of a cell.
HITS, VISITS, MEAN_X, MEAN_Y = range(4)

# The patch of every table where nothing has been seen; it stays empty.
EMPTY = 0

FIRST_CAPACITY = 256  # patches

# Entries of all particles' tables together: 100 MB, and 1.4 km either way for 30 particles.
MOST_ENTRIES = 25_000_000

# A map grows by this much more than needed [m]: upstream's.
ENLARGE_M = 10.0


class Extent(NamedTuple):
    """A rectangle of the map frame [m]."""

    xmin_m: float
    ymin_m: float
    xmax_m: float
    ymax_m: float


class Counts(NamedTuple):
    """Rays that ended in cells, and that ended in or passed them, in a rectangle of a grid."""

    hits: np.ndarray  # (height, width) float32
    visits: np.ndarray  # (height, width) float32
    first_row: int  # in the grid
    first_column: int


class PatchMaps:
    """One grid per particle.

    Attributes:
        cells: (capacity, SIDE, SIDE, 4) float32, a patch's cells by row and column: rays that
            ended in the cell, rays that ended in or passed it, and the mean of the ends, from the
            cell's corner, in cells. Whole numbers are exact up to 2^24, where counting stops.
        table: (particles, rows, columns) int32, where in `cells` a particle's patches are.
        references: (capacity,) int32, how many entries of `table` name a patch.
        free: (capacity,) int32, patches in no table, the first `free_count[0]` of them.
    """

    def __init__(self, extent: Extent, cell_m: float, particle_count: int) -> None:
        """Start with empty maps that cover `extent`."""
        self.cell_m = cell_m
        self.origin_x_m, self.origin_y_m = extent.xmin_m, extent.ymin_m
        rows = _patches_along(extent.ymax_m - extent.ymin_m, cell_m)
        columns = _patches_along(extent.xmax_m - extent.xmin_m, cell_m)
        self.table = np.zeros((particle_count, rows, columns), np.int32)
        self.cells = np.zeros((FIRST_CAPACITY, SIDE, SIDE, 4), np.float32)
        self.references = np.zeros(FIRST_CAPACITY, np.int32)
        self.free, self.free_count = _free_patches(self.references)

    def ensure_free(self, count: int) -> None:
        """Make sure that `count` patches are free; capacity doubles where they are not."""
        capacity = len(self.references)
        missing = count - int(self.free_count[0])
        if missing <= 0:
            return
        while capacity < len(self.references) + missing:
            capacity *= 2
        # Zeros that are never written take no memory.
        cells = np.zeros((capacity, *self.cells.shape[1:]), np.float32)
        references = np.zeros(capacity, np.int32)
        in_use = self.references > 0
        np.copyto(cells[: len(in_use)], self.cells, where=in_use[:, None, None, None])
        references[: len(in_use)] = self.references
        self.cells, self.references = cells, references
        self.free, self.free_count = _free_patches(references)

    def cover(self, extent: Extent) -> None:
        """Grow where `extent` is not on the maps yet.

        Raises:
            InputFault: the maps would be absurdly large. They stay as they are.
        """
        patch_m = SIDE * self.cell_m
        particles, rows, columns = self.table.shape
        left = _patches_beyond(self.origin_x_m - extent.xmin_m, patch_m)
        right = _patches_beyond(extent.xmax_m - self.origin_x_m - columns * patch_m, patch_m)
        below = _patches_beyond(self.origin_y_m - extent.ymin_m, patch_m)
        above = _patches_beyond(extent.ymax_m - self.origin_y_m - rows * patch_m, patch_m)
        if not (left or right or below or above):
            return
        if particles * (below + rows + above) * (left + columns + right) > MOST_ENTRIES:
            raise InputFault(
                f'the map would have to reach from {extent.xmin_m:.0f} to {extent.xmax_m:.0f} m along x and '
                f'from {extent.ymin_m:.0f} to {extent.ymax_m:.0f} m along y: too large'
            )
        self.table = np.pad(self.table, ((0, 0), (below, above), (left, right)))
        self.origin_x_m -= left * patch_m
        self.origin_y_m -= below * patch_m

    def resample(self, indices: np.ndarray) -> None:
        """Give particle i the map of particle `indices[i]`; nothing but tables is copied."""
        self.table = self.table[indices]
        self.references = np.bincount(self.table.ravel(), minlength=len(self.references)).astype(np.int32)
        self.references[EMPTY] = 0
        self.free, self.free_count = _free_patches(self.references)

    def counts(self, particle: int) -> Counts:
        """Return the counts of the smallest rectangle of patches that holds all a particle has seen."""
        row, column = np.nonzero(self.table[particle])
        if len(row) == 0:
            return Counts(np.zeros((0, 0), np.float32), np.zeros((0, 0), np.float32), 0, 0)
        top, left = int(row.min()), int(column.min())
        rows, columns = int(row.max()) + 1 - top, int(column.max()) + 1 - left
        counts = np.zeros((2, rows, SIDE, columns, SIDE), np.float32)
        patches = self.cells[self.table[particle, row, column]]
        counts[0, row - top, :, column - left, :] = patches[..., HITS]
        counts[1, row - top, :, column - left, :] = patches[..., VISITS]
        hits, visits = counts.reshape(2, rows * SIDE, columns * SIDE)
        return Counts(hits, visits, top * SIDE, left * SIDE)


def table_size(extent: Extent, cell_m: float, particle_count: int) -> int:
    """Return the entries of the tables of maps that cover `extent`; MOST_ENTRIES are allowed."""
    rows = _patches_along(extent.ymax_m - extent.ymin_m, cell_m)
    return particle_count * rows * _patches_along(extent.xmax_m - extent.xmin_m, cell_m)


def _patches_along(length_m: float, cell_m: float) -> int:
    return max(1, math.ceil(length_m / (cell_m * SIDE) - 1e-9))


def _patches_beyond(missing_m: float, patch_m: float) -> int:
    """Return by how many patches a map grows on one side; 0 where nothing is missing."""
    return math.ceil((missing_m + ENLARGE_M) / patch_m) if missing_m > 0.0 else 0


def _free_patches(references: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return (capacity,) patches without references, low indices last, and (1,) how many."""
    free = np.zeros(len(references), np.int32)
    found = np.nonzero(references[1:] == 0)[0][::-1] + 1
    free[: len(found)] = found
    return free, np.array([len(found)], np.int64)
