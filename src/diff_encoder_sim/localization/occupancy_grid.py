"""Occupancy grid: free, occupied and unknown cells, as in nav_msgs/OccupancyGrid."""

from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

# Unknown space kept around the known part when a SLAM map is saved.
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
