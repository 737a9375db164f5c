"""The costmap: what it costs the robot's centre to be in a cell.

Three layers as in costmap_2d: the static map, obstacles that scans mark and clear, and the
inflation of both. Costs: 0 free to 252, 253 inscribed (the robot touches however it stands),
254 lethal (an obstacle), 255 unknown.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation import footprint as outlines
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.footprint import LETHAL, NO_INFORMATION
from diff_encoder_sim.navigation.grid_window import GridWindow, window_around
from diff_encoder_sim.navigation.inflation import FREE, INSCRIBED, cost_table, inflate, radius_in_cells
from diff_encoder_sim.navigation.obstacle_layer import clear_and_mark, free_outline
from diff_encoder_sim.navigation.trajectory_scoring import outline_cost

__all__ = ['FREE', 'INSCRIBED', 'LETHAL', 'NO_INFORMATION', 'Costmap']


class Costmap:
    """Layers over a static map, or over a window that moves with the robot.

    All poses are given in the costmap's frame: map for a static one, odom for a window.
    """

    def __init__(self, params: CostmapParams, static_map: Optional[OccupancyGrid] = None) -> None:
        """A costmap over `static_map`, or without one a rolling window around (0, 0).

        Raises:
            ConfigError: the map is empty, or params ask for the other kind.
        """
        if params.rolling_window == (static_map is not None):
            raise ConfigError('a static costmap needs a map, a rolling window takes none')
        self.params = params
        self.footprint = outlines.make_footprint(params.footprint, params.footprint_padding)
        if static_map is not None:
            self._take_map(static_map)
        else:
            self._open_window()
        self._table = cost_table(
            self.resolution_m, self.footprint.inscribed_radius_m, params.inflation_radius, params.cost_scaling_factor
        )
        self._limit = radius_in_cells(params.inflation_radius, self.resolution_m)
        self._changed: Optional[GridWindow] = self._everything()  # not in `_costs` yet

    def _take_map(self, grid: OccupancyGrid) -> None:
        if grid.cells.size == 0:
            raise ConfigError('the map has no cells')
        self.resolution_m, self.origin = grid.resolution_m, grid.origin
        self._static: Optional[np.ndarray] = static_costs(grid.cells, self.params)
        # Where no ray has been, the obstacle layer has no say.
        self._unseen = NO_INFORMATION
        self._allocate(grid.cells.shape)

    def _open_window(self) -> None:
        params = self.params
        self.resolution_m = params.resolution
        rows, columns = (max(1, round(size_m / params.resolution)) for size_m in (params.height, params.width))
        self.origin = Pose2D(-0.5 * columns * self.resolution_m, -0.5 * rows * self.resolution_m, 0.0)
        self._static = None
        self._unseen = NO_INFORMATION if params.track_unknown_space else FREE
        self._allocate((rows, columns))

    def _allocate(self, shape: Tuple[int, int]) -> None:
        self.shape, self._per_m = shape, 1.0 / self.resolution_m
        self._obstacles = np.full(shape, self._unseen, np.uint8)
        self._base = np.empty(shape, np.uint8)
        self._costs = np.empty(shape, np.uint8)

    @property
    def costs(self) -> np.ndarray:
        """(rows, columns) uint8, changed in place when it is asked for after an update."""
        # Inflation is most of an update's work, and between two plans nobody looks at a whole map.
        if self._changed is not None:
            self._refresh(self._changed)
            self._changed = None
        return self._costs

    # ---- where things are

    @property
    def cells_per_m(self) -> float:
        """Cells in a metre."""
        return self._per_m

    def pose_in_grid(self, pose: Pose2D) -> Pose2D:
        """A pose as seen from the grid's corner: x along columns, y along rows [m]."""
        return pose.relative_to(self.origin)

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """(row, column) of the cell that holds a point; may be outside."""
        local = self.pose_in_grid(Pose2D(x_m, y_m, 0.0))
        return math.floor(local.y_m * self._per_m), math.floor(local.x_m * self._per_m)

    def contains(self, row: int, column: int) -> bool:
        """Whether a cell is on the map."""
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1]

    def cost_at(self, x_m: float, y_m: float) -> Optional[int]:
        """Cost of the cell that holds a point, None outside."""
        row, column = self.cell_at(x_m, y_m)
        return int(self.costs[row, column]) if self.contains(row, column) else None

    def footprint_cost(self, base_pose: Pose2D) -> float:
        """Highest cost under the outline of the robot at a pose.

        Below zero where it cannot stand: footprint.IN_OBSTACLE, IN_UNKNOWN or OFF_MAP.
        """
        local = self.pose_in_grid(base_pose)
        return outline_cost(
            self.costs,
            self._per_m,
            self.footprint.vertices_m,
            local.x_m,
            local.y_m,
            math.cos(local.yaw_rad),
            math.sin(local.yaw_rad),
        )

    def is_static_obstacle(self, x_m: float, y_m: float) -> bool:
        """Whether the static map alone keeps the robot's centre from a point."""
        row, column = self.cell_at(x_m, y_m)
        if self._static is None or not self.contains(row, column):
            return False
        reach = math.floor(self.footprint.inscribed_radius_m * self._per_m)
        near = self._static[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1]
        rows, columns = np.nonzero(near == LETHAL)
        squared = (rows - min(row, reach)) ** 2 + (columns - min(column, reach)) ** 2
        return bool(len(squared)) and bool(
            math.sqrt(squared.min()) * self.resolution_m <= self.footprint.inscribed_radius_m
        )

    # ---- what changes it

    def update(self, base_pose: Pose2D, scan: Optional[Scan] = None, laser_pose: Optional[Pose2D] = None) -> None:
        """One cycle: move the window, enter a scan, free the robot's own place.

        Args:
            base_pose: the robot now.
            scan: the newest scan, or None for no news.
            laser_pose: the laser when it took the scan.
        """
        if self._static is None:
            self._roll_to(base_pose)
        reach_m = self.footprint.circumscribed_radius_m
        touched = [(self.pose_in_grid(base_pose), reach_m)]
        if scan is not None and laser_pose is not None:
            laser = self.pose_in_grid(laser_pose)
            self._enter(scan, laser)
            reach_m = max(self.params.raytrace_range, self.params.obstacle_range)
            touched.append((laser, reach_m))
        if self.params.footprint_clearing_enabled:
            self._clear_footprint(base_pose)
        for place, reach_m in touched if self._static is not None else ():
            self._note_change(window_around(place, reach_m, self._per_m, self.shape))
        if self._static is None:
            self._note_change(self._everything())

    def clear_obstacles(self, base_pose: Pose2D, reset_distance_m: float = 0.0) -> None:
        """Forget the obstacle layer outside a square of this side around the robot."""
        cleared = np.full_like(self._obstacles, self._unseen)
        if reset_distance_m > 0.0:
            kept = window_around(self.pose_in_grid(base_pose), 0.5 * reset_distance_m, self._per_m, self.shape).cells
            cleared[kept] = self._obstacles[kept]
        self._obstacles = cleared
        self._note_change(self._everything())

    def _enter(self, scan: Scan, laser: Pose2D) -> None:
        params, source = self.params, self.params.scan
        if not params.observation_sources:
            return
        clear_and_mark(
            self._obstacles,
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

    def _clear_footprint(self, base_pose: Pose2D) -> None:
        local = self.pose_in_grid(base_pose)
        cos_yaw, sin_yaw = math.cos(local.yaw_rad), math.sin(local.yaw_rad)
        turned = self.footprint.vertices_m @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
        corners_m = turned + (local.x_m, local.y_m)
        outlines.fill_polygon(self._obstacles, self._per_m, corners_m, FREE)
        free_outline(self._obstacles, self._per_m, corners_m)

    def _roll_to(self, base_pose: Pose2D) -> None:
        """Centre the window on the robot by whole cells, keeping what stays in sight."""
        rows, columns = self.shape
        local = self.pose_in_grid(base_pose)
        down = math.floor(local.y_m * self._per_m) - rows // 2
        right = math.floor(local.x_m * self._per_m) - columns // 2
        if not (down or right):
            return
        moved = np.full_like(self._obstacles, self._unseen)
        if abs(down) < rows and abs(right) < columns:
            moved[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)] = self._obstacles[
                max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)
            ]
        self._obstacles = moved
        self.origin = Pose2D(
            self.origin.x_m + right * self.resolution_m, self.origin.y_m + down * self.resolution_m, 0.0
        )

    def _note_change(self, window: GridWindow) -> None:
        """Have a window refreshed before anyone sees its costs."""
        if not window.is_empty:  # else all of it is off the map
            self._changed = window if self._changed is None else self._changed.around_both(window)

    def _refresh(self, window: GridWindow) -> None:
        """Combine the layers inside a window and inflate as far as that reaches."""
        obstacles = self._obstacles[window.cells]
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
    """(rows, columns) uint8 costs of occupancy -1 to 100, as costmap_2d's static layer."""
    scaled = (
        np.zeros(cells.shape)
        if params.trinary_costmap
        else float(LETHAL) * np.maximum(cells, 0) / params.lethal_cost_threshold
    )
    costs = np.where(cells >= params.lethal_cost_threshold, LETHAL, scaled)
    return np.where(cells < 0, NO_INFORMATION if params.track_unknown_space else FREE, costs).astype(np.uint8)
