"""Obstacle layer: what scans have marked and not cleared since, as costmap_2d's ObstacleLayer."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.cost_values import FREE
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.footprint import fill_polygon
from diff_encoder_sim.navigation.grid_window import GridWindow
from diff_encoder_sim.navigation.ray_clearing import clear_and_mark, clear_outline


class ObstacleLayer:
    """Cells of a costmap that hold obstacles, free space or `unseen`; places are in the grid's own frame.

    Args:
        params: the costmap's.
        shape: (rows, columns) of the costmap.
        per_m: cells in a metre.
        unseen: cost of cells where no ray has been.
    """

    def __init__(self, params: CostmapParams, shape: Tuple[int, int], per_m: float, unseen: int) -> None:
        self.cells = np.full(shape, unseen, np.uint8)
        self._params, self._per_m, self._unseen = params, per_m, unseen

    def enter(self, scan: Scan, laser: Pose2D) -> None:
        """Clear and mark by a scan taken at `laser`."""
        params, source = self._params, self._params.scan
        if not params.observation_sources:
            return
        clear_and_mark(
            self.cells,
            self._per_m,
            laser.x_m,
            laser.y_m,
            laser.yaw_rad,
            scan.angle_min_rad,
            scan.angle_increment_rad,
            np.asarray(scan.ranges_m, dtype=np.float64),
            scan.range_min_m,
            scan.range_max_m,
            params.raytrace_range,
            params.obstacle_range,
            source.inf_is_valid,
            source.clearing,
            source.marking,
        )

    def clear_polygon(self, corners_m: np.ndarray) -> None:
        """Clear the cells inside a polygon (n, 2) and those that its sides cross."""
        fill_polygon(self.cells, self._per_m, corners_m, FREE)
        clear_outline(self.cells, self._per_m, corners_m)

    def forget(self, kept: Optional[GridWindow] = None) -> None:
        """Make all cells unseen, except those of a window."""
        cells = np.full_like(self.cells, self._unseen)
        if kept is not None:
            cells[kept.cells] = self.cells[kept.cells]
        self.cells = cells

    def shift(self, down: int, right: int) -> None:
        """Move the grid by whole rows and columns over the world, keeping the cells in sight."""
        rows, columns = self.cells.shape
        moved = np.full_like(self.cells, self._unseen)
        if abs(down) < rows and abs(right) < columns:
            moved[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)] = self.cells[
                max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)
            ]
        self.cells = moved
