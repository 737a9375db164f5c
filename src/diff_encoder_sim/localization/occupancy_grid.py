"""Occupancy grid: free, occupied and unknown cells, as in nav_msgs/OccupancyGrid; distances to occupied cells."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
SAVED_MARGIN_M = 0.5  # of unknown space around the known part of a saved SLAM map


class OccupancyGrid(NamedTuple):
    """Map as in nav_msgs/OccupancyGrid; rows run along y and columns along x of the grid's own frame.

    `origin` is the pose of that frame, the outer corner of cells[0, 0], in the map frame.
    """

    cells: np.ndarray  # (height, width) int8: 0 free to 100 occupied, -1 unknown
    resolution_m: float  # side of a cell
    origin: Pose2D

    @property
    def height(self) -> int:
        """Return the number of cells along y."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Return the number of cells along x."""
        return int(self.cells.shape[1])

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """Return (row, column) of the cell at a point of the map frame; it may be outside the grid."""
        local = Pose2D(x_m, y_m, 0.0).relative_to(self.origin)
        return int(np.floor(local.y_m / self.resolution_m)), int(np.floor(local.x_m / self.resolution_m))

    def cropped(self, margin_m: float) -> OccupancyGrid:
        """Return the known part with a margin around it, or the whole grid if nothing is known."""
        rows, columns = np.nonzero(self.cells != UNKNOWN)
        if len(rows) == 0:
            return self
        margin = round(margin_m / self.resolution_m)
        top, left = max(0, rows.min() - margin), max(0, columns.min() - margin)
        corner = self.origin.compose(Pose2D(left * self.resolution_m, top * self.resolution_m, 0.0))
        cells = self.cells[top : rows.max() + 1 + margin, left : columns.max() + 1 + margin]
        return OccupancyGrid(np.ascontiguousarray(cells), self.resolution_m, corner)

    def contains(self, row: int, column: int) -> bool:
        """Return whether a cell is on the grid."""
        return 0 <= row < self.height and 0 <= column < self.width


def square_room() -> OccupancyGrid:
    """Return the map of an empty room of 6 x 6 m around the origin, in which kernels are warmed up."""
    cells = np.pad(np.full((58, 58), FREE, np.int8), 1, constant_values=OCCUPIED)
    return OccupancyGrid(cells, 0.1, Pose2D(-3.0, -3.0, 0.0))


# A cell with a smaller fraction of a neighbour's hits is noise of the neighbour's rays; upstream marks it as occupied.
# Two cells with a wall on their border have about half of the hits each: both are occupied, without a bias.
STRAY_FRACTION = 0.3


def occupancy(hits: np.ndarray, visits: np.ndarray, occ_thresh: float) -> np.ndarray:
    """Return (height, width) int8 0, 100, if more than a fraction of the visits are hits, or -1 without visits.

    Rays that ended in a cell are its hits, and these and rays that passed it are its visits, both (height, width).
    """
    is_occupied, padded = hits > occ_thresh * visits, np.pad(hits, 1)
    around = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    largest_around = np.maximum(np.maximum(around[:, :-2], around[:, 1:-1]), around[:, 2:])
    is_stray = is_occupied & (hits < STRAY_FRACTION * largest_around)
    return np.select([is_stray | (visits == 0.0), is_occupied], [UNKNOWN, OCCUPIED], FREE).astype(np.int8)


class FreeCells:
    """The free cells of a grid, in 4 bytes each; places are computed on request."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        self._cells = np.flatnonzero(grid.cells == FREE).astype(np.int32)

    def __len__(self) -> int:
        return len(self._cells)

    def centres(self, numbers: np.ndarray) -> np.ndarray:
        """Return (n, 2) x, y [m] in the map of the centres of free cells, numbered (n,) from 0."""
        rows, columns = np.divmod(self._cells[numbers], self._grid.width)
        origin, resolution_m = self._grid.origin, self._grid.resolution_m
        x_m, y_m = (columns + 0.5) * resolution_m, (rows + 0.5) * resolution_m
        cos_yaw, sin_yaw = np.cos(origin.yaw_rad), np.sin(origin.yaw_rad)
        return np.column_stack([origin.x_m + cos_yaw * x_m - sin_yaw * y_m, origin.y_m + sin_yaw * x_m + cos_yaw * y_m])


class DistanceField(NamedTuple):
    """The distance from each cell's centre to that of the nearest occupied one, as a table of the different ones."""

    indices: np.ndarray  # (height, width) int32, of `distances_m`
    distances_m: np.ndarray  # (n,), rising; the last one is the largest that is distinguished


def distance_field(occupied: np.ndarray, resolution_m: float, max_distance_m: float) -> DistanceField:
    """Return the distances from all cells to `occupied` ones (height, width), at most `max_distance_m`."""
    (height, width), limit = occupied.shape, math.ceil(max_distance_m / resolution_m)
    most = min(limit**2, height**2 + width**2)  # larger squares are beyond the limit, or on no grid of this size
    distances_m = np.minimum(np.sqrt(np.arange(most + 1)) * resolution_m, max_distance_m)
    distances_m[most] = max_distance_m
    squared = squared_distances(np.ascontiguousarray(occupied, dtype=np.bool_), min(limit, height + width))
    return DistanceField(np.minimum(squared, most).astype(np.int32), distances_m)


@compiled
def squared_distances(is_obstacle: Array, limit: int) -> np.ndarray:
    """Return the squared distances to the nearest obstacle, (rows, columns) float32 in cells^2.

    Exact up to `limit` cells, up to 4000; beyond, above limit^2. Processors compare eight float32 at once.
    """
    rows, columns = is_obstacle.shape
    none, one, most = np.float32(0.0), np.float32(1.0), np.float32(limit + 1)
    away = np.empty((rows, columns), np.float32)
    for column in range(columns):
        away[0, column] = none if is_obstacle[0, column] else most
    for row in range(1, rows):
        for column in range(columns):
            away[row, column] = none if is_obstacle[row, column] else min(away[row - 1, column] + one, most)
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            away[row, column] = min(away[row, column], away[row + 1, column] + one)
    squared = np.empty((rows, columns), np.float32)
    # Beyond both ends of a row there is nothing near.
    fenced = np.full(columns + 2 * limit, (limit + 1) ** 2, np.float32)
    for row in range(rows):
        nearest = most
        for column in range(columns):
            nearest = min(nearest, away[row, column])
            squared[row, column] = fenced[limit + column] = away[row, column] * away[row, column]
        if nearest <= limit:
            _search_row(fenced, limit, squared[row])
    return squared


@compiled
def _search_row(fenced: Array, limit: int, squared: Array) -> None:
    """Lower a row of squared distances (n,) by those along columns, `fenced` by `limit` cells before and after."""
    for offset in range(1, limit + 1):
        aside = np.float32(offset * offset)
        left, right = fenced[limit - offset :], fenced[limit + offset :]
        for column in range(len(squared)):
            squared[column] = min(squared[column], min(left[column], right[column]) + aside)
