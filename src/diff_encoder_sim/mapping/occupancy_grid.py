"""The occupancy grid: what is free, occupied or unknown, cell by cell."""

from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

# Of a map that SLAM made, as much unknown is kept around what is known.
SAVED_MARGIN_M = 0.5


class OccupancyGrid(NamedTuple):
    """A map as in nav_msgs/OccupancyGrid.

    `cells[row, column]` is the cell whose corner nearest to the origin is at (column, row) times
    the resolution along x and y of the grid's own frame; `origin` is the pose of that frame, so
    of the outer corner of cells[0, 0], in the map frame.
    """

    cells: np.ndarray  # (height, width) int8: 0 free to 100 occupied, -1 unknown
    resolution_m: float  # side of a cell
    origin: Pose2D

    @property
    def height(self) -> int:
        """Cells along y."""
        return int(self.cells.shape[0])

    @property
    def width(self) -> int:
        """Cells along x."""
        return int(self.cells.shape[1])

    def cell_centre(self, row: int, column: int) -> Tuple[float, float]:
        """Centre (x, y) [m] of a cell in the map frame."""
        centre = self.origin.compose(Pose2D((column + 0.5) * self.resolution_m, (row + 0.5) * self.resolution_m, 0.0))
        return centre.x_m, centre.y_m

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """(row, column) of the cell that holds a point of the map frame; may be outside."""
        local = Pose2D(x_m, y_m, 0.0).relative_to(self.origin)
        return (int(np.floor(local.y_m / self.resolution_m)), int(np.floor(local.x_m / self.resolution_m)))

    def cropped(self, margin_m: float) -> OccupancyGrid:
        """The part that is known and a margin around it; the whole where nothing is."""
        rows, columns = np.nonzero(self.cells != UNKNOWN)
        if len(rows) == 0:
            return self
        margin = round(margin_m / self.resolution_m)
        top, left = max(0, rows.min() - margin), max(0, columns.min() - margin)
        corner = self.origin.compose(Pose2D(left * self.resolution_m, top * self.resolution_m, 0.0))
        cells = self.cells[top : rows.max() + 1 + margin, left : columns.max() + 1 + margin]
        return OccupancyGrid(np.ascontiguousarray(cells), self.resolution_m, corner)

    def contains(self, row: int, column: int) -> bool:
        """Whether a cell is on the grid."""
        return 0 <= row < self.height and 0 <= column < self.width
