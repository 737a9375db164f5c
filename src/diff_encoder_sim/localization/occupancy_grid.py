"""Occupancy grid: free, occupied and unknown cells, as in nav_msgs/OccupancyGrid."""

from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

# Margin of unknown space around the known part of a saved SLAM map.
SAVED_MARGIN_M = 0.5


class OccupancyGrid(NamedTuple):
    """Map as in nav_msgs/OccupancyGrid.

    Rows run along y and columns along x of the grid's own frame. `origin` is the pose of that frame, the outer
    corner of cells[0, 0], in the map frame.
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
        return (int(np.floor(local.y_m / self.resolution_m)), int(np.floor(local.x_m / self.resolution_m)))

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


CELLS, RESOLUTION_M = 60, 0.1  # of the room below


def square_room() -> OccupancyGrid:
    """Return the map of an empty room of 6 x 6 m around the origin, in which kernels are warmed up."""
    cells = np.full((CELLS, CELLS), OCCUPIED, np.int8)
    cells[1:-1, 1:-1] = FREE
    corner_m = -0.5 * CELLS * RESOLUTION_M
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(corner_m, corner_m, 0.0))


# A cell with less than this fraction of the hits of a neighbour is not a surface but noise of the
# neighbour's rays; upstream marks it as occupied. Two cells with a wall on their border have about half
# of the hits each, and both are occupied: opposite walls are marked symmetrically, without a bias of
# localization.
STRAY_FRACTION = 0.3


def occupancy(hits: np.ndarray, visits: np.ndarray, occ_thresh: float) -> np.ndarray:
    """Return (height, width) int8: 0, 100 or -1.

    Args:
        hits: (height, width) rays that ended in a cell.
        visits: (height, width) rays that ended in it or passed it; 0 is unknown.
        occ_thresh: a cell is occupied if more than this fraction of its visits are hits.
    """
    is_occupied, padded = hits > occ_thresh * visits, np.pad(hits, 1)
    around = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    largest_around = np.maximum(np.maximum(around[:, :-2], around[:, 1:-1]), around[:, 2:])
    is_stray = is_occupied & (hits < STRAY_FRACTION * largest_around)
    return np.select([is_stray | (visits == 0.0), is_occupied], [UNKNOWN, OCCUPIED], FREE).astype(np.int8)


class FreeCells:
    """Their numbers, 4 bytes a cell; their places are computed where they are asked for."""

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
