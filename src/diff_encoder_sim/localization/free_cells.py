"""The free cells of a map, from which particles are drawn that may be anywhere."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.localization.occupancy_grid import FREE, OccupancyGrid


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
        origin = self._grid.origin
        local_x = (columns + 0.5) * self._grid.resolution_m
        local_y = (rows + 0.5) * self._grid.resolution_m
        cos_yaw, sin_yaw = np.cos(origin.yaw_rad), np.sin(origin.yaw_rad)
        return np.column_stack(
            [origin.x_m + cos_yaw * local_x - sin_yaw * local_y, origin.y_m + sin_yaw * local_x + cos_yaw * local_y]
        )
