"""Costmap: the cost of each cell as a place for the robot's centre.

Three layers as in costmap_2d: the static map, obstacles that scans mark and clear, and the inflation of both. Costs
are those of cost_values.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap_layers import (
    FREE,
    LETHAL,
    NO_INFORMATION,
    GridWindow,
    ObstacleLayer,
    cost_table,
    inflate,
    radius_in_cells,
    window_around,
)
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.dwa_kernels import footprint_cost
from diff_encoder_sim.navigation.footprint import make_footprint


class Costmap:
    """Layers over a static map, or over a rolling window around the robot.

    All poses are in the costmap's frame: map for a static map, odom for a window.

    Args:
        params: must fit `static_map`.
        static_map: without one the costmap is a rolling window, at first around (0, 0).

    Raises:
        ConfigError: the map is empty, or params ask for the other kind of costmap.
    """

    def __init__(self, params: CostmapParams, static_map: Optional[OccupancyGrid] = None) -> None:
        if params.rolling_window == (static_map is not None):
            raise ConfigError('a static costmap needs a map, a rolling window takes none')
        self.params, self._map = params, static_map
        self.footprint = make_footprint(params.footprint, params.footprint_padding)
        if static_map is not None:
            self._use_map(static_map)
        else:
            self._open_window()
        radius_m, inscribed_m = params.inflation_radius, self.footprint.inscribed_radius_m
        self._table = cost_table(self.resolution_m, inscribed_m, radius_m, params.cost_scaling_factor)
        self._limit = radius_in_cells(radius_m, self.resolution_m)
        self._changed: Optional[GridWindow] = self._everything()  # not in `_costs` yet

    def _use_map(self, grid: OccupancyGrid) -> None:
        if grid.cells.size == 0:
            raise ConfigError('the map has no cells')
        self.resolution_m, self.origin = grid.resolution_m, grid.origin
        self._static: Optional[np.ndarray] = static_costs(grid.cells, self.params)
        # Where no ray has been, the static map counts.
        self._allocate((grid.height, grid.width), unseen=NO_INFORMATION)

    def _open_window(self) -> None:
        params = self.params
        self.resolution_m = params.resolution
        rows, columns = (max(1, round(size_m / params.resolution)) for size_m in (params.height, params.width))
        self.origin = Pose2D(-0.5 * columns * self.resolution_m, -0.5 * rows * self.resolution_m, 0.0)
        self._static = None
        self._allocate((rows, columns), unseen=NO_INFORMATION if params.track_unknown_space else FREE)

    def _allocate(self, shape: Tuple[int, int], unseen: int) -> None:
        self.shape, self._per_m = shape, 1.0 / self.resolution_m
        self._obstacles = ObstacleLayer(self.params, shape, self._per_m, unseen)
        self._base = np.empty(shape, np.uint8)
        self._costs = np.empty(shape, np.uint8)

    @property
    def costs(self) -> np.ndarray:
        """Return the costs, (rows, columns) uint8; the array is changed in place after an update."""
        # Inflation is most of an update's work, and the global costs are read by few control periods.
        if self._changed is not None:
            self._refresh(self._changed)
            self._changed = None
        return self._costs

    # ---- geometry

    @property
    def cells_per_m(self) -> float:
        """Return the number of cells in a metre."""
        return self._per_m

    def pose_in_grid(self, pose: Pose2D) -> Pose2D:
        """Return a pose in the grid's own frame: x along columns, y along rows [m]."""
        return pose.relative_to(self.origin)

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """Return (row, column) of the cell at a point; it may be outside the grid."""
        local = self.pose_in_grid(Pose2D(x_m, y_m, 0.0))
        return math.floor(local.y_m * self._per_m), math.floor(local.x_m * self._per_m)

    def contains(self, row: int, column: int) -> bool:
        """Return whether a cell is on the grid."""
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1]

    # ---- costs at places

    def cost_at(self, x_m: float, y_m: float) -> Optional[int]:
        """Return the cost of the cell at a point, None outside the grid."""
        row, column = self.cell_at(x_m, y_m)
        return int(self.costs[row, column]) if self.contains(row, column) else None

    def footprint_cost(self, base_pose: Pose2D) -> float:
        """Return the highest cost under the robot's outline at a pose.

        Below zero where it cannot stand: footprint.IN_OBSTACLE, IN_UNKNOWN or OFF_MAP.
        """
        x_m, y_m, yaw_rad = self.pose_in_grid(base_pose)
        cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
        return float(footprint_cost(self.costs, self._per_m, self.footprint.vertices_m, x_m, y_m, cos_yaw, sin_yaw))

    def is_static_obstacle(self, x_m: float, y_m: float) -> bool:
        """Return whether the static map alone keeps the robot's centre from a point."""
        row, column = self.cell_at(x_m, y_m)
        if self._static is None or not self.contains(row, column):
            return False
        radius_m = self.footprint.inscribed_radius_m
        reach = math.floor(radius_m * self._per_m)
        near = self._static[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
        rows, columns = np.nonzero(near == LETHAL)
        squared = (rows - min(row, reach)) ** 2 + (columns - min(column, reach)) ** 2
        return len(squared) > 0 and math.sqrt(squared.min()) * self.resolution_m <= radius_m

    # ---- changes

    def update(self, base_pose: Pose2D, scan: Optional[Scan] = None, laser_pose: Optional[Pose2D] = None) -> None:
        """Run one cycle: centre the window, enter the newest scan, clear the robot's footprint.

        Args:
            base_pose: the robot now.
            scan: the newest scan; None enters none.
            laser_pose: the laser when it took the scan.
        """
        if self._static is None:
            self._roll_to(base_pose)
            self._note_change(self._everything())
        else:
            self._note_change_around(self.pose_in_grid(base_pose), self.footprint.circumscribed_radius_m)
        if scan is not None and laser_pose is not None:
            laser = self.pose_in_grid(laser_pose)
            self._obstacles.enter(scan, laser)
            self._note_change_around(laser, max(self.params.raytrace_range, self.params.obstacle_range))
        if self.params.footprint_clearing_enabled:
            self._clear_footprint(base_pose)

    def reconfigured(self, params: CostmapParams) -> Costmap:
        """Return a costmap with other parameters: with the obstacles of this one, unless its cells are others."""
        other = Costmap(params, self._map)
        is_alike = (other.shape, other.resolution_m) == (self.shape, self.resolution_m)
        if is_alike and params.observation_sources:
            other.origin, other._obstacles.cells = self.origin, self._obstacles.cells
        return other

    def clear_obstacles(self, base_pose: Pose2D, reset_distance_m: float = 0.0) -> None:
        """Forget the obstacle layer outside a square of this side around the robot."""
        kept = None
        if reset_distance_m > 0.0:
            kept = window_around(self.pose_in_grid(base_pose), 0.5 * reset_distance_m, self._per_m, self.shape)
        self._obstacles.forget(kept)
        self._note_change(self._everything())

    def _clear_footprint(self, base_pose: Pose2D) -> None:
        self._obstacles.clear_polygon(transform_points(self.pose_in_grid(base_pose), self.footprint.vertices_m))

    def _roll_to(self, base_pose: Pose2D) -> None:
        """Centre the window on the robot by whole cells."""
        local = self.pose_in_grid(base_pose)
        down = math.floor(local.y_m * self._per_m) - self.shape[0] // 2
        right = math.floor(local.x_m * self._per_m) - self.shape[1] // 2
        if down or right:
            self._obstacles.shift(down, right)
            x_m, y_m = self.origin.x_m + right * self.resolution_m, self.origin.y_m + down * self.resolution_m
            self.origin = Pose2D(x_m, y_m, 0.0)

    # ---- refreshing the costs

    def _note_change_around(self, place: Pose2D, reach_m: float) -> None:
        self._note_change(window_around(place, reach_m, self._per_m, self.shape))

    def _note_change(self, window: GridWindow) -> None:
        """Have a window refreshed before its costs are read."""
        if not window.is_empty:  # else all of it is off the map
            self._changed = window if self._changed is None else self._changed.around_both(window)

    def _refresh(self, window: GridWindow) -> None:
        """Combine the layers inside a window and inflate as far as that reaches."""
        obstacles = self._obstacles.cells[window.cells]
        if self._static is None:
            self._base[window.cells] = obstacles
        else:
            static = self._static[window.cells]
            seen = obstacles != NO_INFORMATION
            higher = seen & ((static == NO_INFORMATION) | (obstacles > static))
            self._base[window.cells] = np.where(higher, obstacles, static)
        inflate(self._base, self._costs, self._table, self._limit, *window.with_margin(self._limit, self.shape))

    def _everything(self) -> GridWindow:
        return GridWindow(0, self.shape[0], 0, self.shape[1])


def static_costs(cells: np.ndarray, params: CostmapParams) -> np.ndarray:
    """Return the costs, (rows, columns) uint8, of occupancies -1 to 100, as costmap_2d's static layer."""
    threshold = params.lethal_cost_threshold
    scaled = np.zeros(cells.shape) if params.trinary_costmap else float(LETHAL) * np.maximum(cells, 0) / threshold
    costs = np.where(cells >= threshold, LETHAL, scaled)
    return np.where(cells < 0, NO_INFORMATION if params.track_unknown_space else FREE, costs).astype(np.uint8)
