"""Costmap: the cost of each cell as a place for the robot's centre.

Three layers as in costmap_2d: the static map, obstacles that scans mark and clear, and the inflation of both. Costs
are those of costmap_layers.
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
    RayRules,
    Window,
    clear_and_mark,
    clear_polygon,
    cost_table,
    inflate,
)
from diff_encoder_sim.navigation.costmap_params import CostmapParams, make_footprint
from diff_encoder_sim.navigation.dwa_kernels import footprint_cost


class Costmap:
    """Layers over a static map, or over a rolling window around the robot.

    All poses are in the costmap's frame: map for a static map, odom for a window.

    Args:
        params: must fit `static_map`.
        static_map: without one the costmap is a rolling window, at first around (0, 0).

    Raises:
        ConfigError: the map is empty.
    """

    def __init__(self, params: CostmapParams, static_map: Optional[OccupancyGrid] = None) -> None:
        self.params, self._map = params, static_map
        self.footprint = make_footprint(params.footprint, params.footprint_padding)
        self._static: Optional[np.ndarray] = None
        if static_map is None:
            self.resolution_m = params.resolution
            rows, columns = (max(1, round(size_m / params.resolution)) for size_m in (params.height, params.width))
            self.shape = rows, columns
            self._place(Pose2D(-0.5 * columns * self.resolution_m, -0.5 * rows * self.resolution_m, 0.0))
            self._unseen = NO_INFORMATION if params.track_unknown_space else FREE
        elif static_map.cells.size == 0:
            raise ConfigError('the map has no cells')
        else:
            self.resolution_m = static_map.resolution_m
            self._place(static_map.origin)
            self.shape = static_map.height, static_map.width
            self._static = static_costs(static_map.cells, params)
            self._unseen = NO_INFORMATION  # cells without rays use the static map
        self.cells_per_m = 1.0 / self.resolution_m
        self._obstacles = np.full(self.shape, self._unseen, np.uint8)
        self._base, self._costs = np.empty(self.shape, np.uint8), np.empty(self.shape, np.uint8)
        # The inflation radius in cells, rounded up as upstream does.
        self._limit = max(0, math.ceil(params.inflation_radius / self.resolution_m - 1e-9))
        inscribed_m = self.footprint.inscribed_radius_m
        self._table = cost_table(self._limit, self.resolution_m, inscribed_m, params.cost_scaling_factor)
        ranges, source = (params.raytrace_range, params.obstacle_range), params.scan
        self._rules = RayRules(*ranges, source.inf_is_valid, source.clearing, source.marking)
        self._everything: Window = (0, self.shape[0], 0, self.shape[1])
        self._changed: Optional[Window] = self._everything  # not in `_costs` yet

    @property
    def costs(self) -> np.ndarray:
        """Return the costs, (rows, columns) uint8; the array is changed in place after an update."""
        # Inflation is most of an update's work, and the global costs are read by few control periods.
        if self._changed is not None:
            base = self._obstacles
            if self._static is not None:  # the higher cost of map and obstacles where rays have been
                cells = slice(*self._changed[:2]), slice(*self._changed[2:])
                seen, walls, base = self._obstacles[cells], self._static[cells], self._base
                is_higher = (seen != NO_INFORMATION) & ((walls == NO_INFORMATION) | (seen > walls))
                base[cells] = np.where(is_higher, seen, walls)
            inflate(base, self._costs, self._table, self._limit, self._changed)
            self._changed = None
        return self._costs

    def _place(self, origin: Pose2D) -> None:
        self.origin, self._frame_in_grid = origin, origin.inverse()

    # ---- places

    def pose_in_grid(self, pose: Pose2D) -> Pose2D:
        """Return a pose in the grid's own frame: x along columns, y along rows [m]."""
        return self._frame_in_grid.compose(pose)

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """Return (row, column) of the cell at a point; it may be outside the grid."""
        local = self.pose_in_grid(Pose2D(x_m, y_m, 0.0))
        return math.floor(local.y_m * self.cells_per_m), math.floor(local.x_m * self.cells_per_m)

    def contains(self, row: int, column: int) -> bool:
        """Return whether a cell is on the grid."""
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1]

    def cost_at(self, x_m: float, y_m: float) -> Optional[int]:
        """Return the cost of the cell at a point, None outside the grid."""
        row, column = self.cell_at(x_m, y_m)
        return int(self.costs[row, column]) if self.contains(row, column) else None

    def footprint_cost(self, base_pose: Pose2D) -> float:
        """Return the highest cost under the robot's outline at a pose.

        Negative if it collides: costmap_layers.IN_OBSTACLE, IN_UNKNOWN or OFF_MAP.
        """
        x_m, y_m, yaw_rad = self.pose_in_grid(base_pose)
        place = x_m, y_m, math.cos(yaw_rad), math.sin(yaw_rad)
        return float(footprint_cost(self.costs, self.cells_per_m, self.footprint.vertices_m, place))

    def is_static_obstacle(self, x_m: float, y_m: float) -> bool:
        """Return whether the static map blocks the robot's centre at a point of the grid."""
        if self._static is None:
            return False
        rows, columns = np.nonzero(self._static == LETHAL)
        row, column = self.cell_at(x_m, y_m)
        reach_m = np.hypot(rows - row, columns - column).min(initial=math.inf) * self.resolution_m
        return bool(reach_m <= self.footprint.inscribed_radius_m)

    # ---- changes

    def update(self, base_pose: Pose2D, scan: Optional[Scan] = None, laser_pose: Optional[Pose2D] = None) -> None:
        """Run one cycle: centre the window, enter the newest scan, clear the robot's footprint.

        Args:
            base_pose: the robot now.
            scan: the newest scan; None enters none.
            laser_pose: the laser when it took the scan.
        """
        if self._static is None:
            self._roll_to(self.pose_in_grid(base_pose))
        base = self.pose_in_grid(base_pose)
        self._note_change(base, self.footprint.circumscribed_radius_m)
        if scan is not None and laser_pose is not None and self.params.observation_sources:
            laser = self.pose_in_grid(laser_pose)
            clear_and_mark(self._obstacles, self.cells_per_m, laser, scan, self._rules)
            self._note_change(laser, max(self._rules[:2]))
        if self.params.footprint_clearing_enabled:
            clear_polygon(self._obstacles, self.cells_per_m, transform_points(base, self.footprint.vertices_m))

    def reconfigured(self, params: CostmapParams) -> Costmap:
        """Return a costmap with other parameters: with the obstacles of this one, unless its cells are others."""
        other = Costmap(params, self._map)
        is_alike = (other.shape, other.resolution_m) == (self.shape, self.resolution_m)
        if is_alike and params.observation_sources:
            other._place(self.origin)
            other._obstacles = self._obstacles
        return other

    def clear_obstacles(self, base_pose: Pose2D, reset_distance_m: float = 0.0) -> None:
        """Forget the obstacle layer outside a square of this side around the robot."""
        cells = np.full_like(self._obstacles, self._unseen)
        if reset_distance_m > 0.0:
            top, bottom, left, right = self._around(self.pose_in_grid(base_pose), 0.5 * reset_distance_m)
            cells[top:bottom, left:right] = self._obstacles[top:bottom, left:right]
        self._obstacles, self._changed = cells, self._everything

    def _roll_to(self, base: Pose2D) -> None:
        """Centre the window on the robot by whole cells, keeping the cells in sight."""
        self._changed, (rows, columns) = self._everything, self.shape
        down = math.floor(base.y_m * self.cells_per_m) - rows // 2
        right = math.floor(base.x_m * self.cells_per_m) - columns // 2
        if not (down or right):
            return
        moved = np.full_like(self._obstacles, self._unseen)
        if abs(down) < rows and abs(right) < columns:
            moved[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)] = self._obstacles[
                max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)
            ]
        x_m, y_m = self.origin.x_m + right * self.resolution_m, self.origin.y_m + down * self.resolution_m
        self._obstacles = moved
        self._place(Pose2D(x_m, y_m, 0.0))

    def _around(self, place: Pose2D, reach_m: float) -> Window:
        """Return the cells within `reach_m` of a place in the grid's own frame, along both axes; maybe none."""
        (rows, columns), per_m = self.shape, self.cells_per_m
        return (
            min(max(0, math.floor((place.y_m - reach_m) * per_m)), rows),
            min(max(0, math.floor((place.y_m + reach_m) * per_m) + 1), rows),
            min(max(0, math.floor((place.x_m - reach_m) * per_m)), columns),
            min(max(0, math.floor((place.x_m + reach_m) * per_m) + 1), columns),
        )

    def _note_change(self, place: Pose2D, reach_m: float) -> None:
        """Have the cells around a place refreshed before the costs are read."""
        if self._changed == self._everything:
            return
        top, bottom, left, right = window = self._around(place, reach_m)
        if top < bottom and left < right:  # else all of it is off the map
            before = self._changed or window
            self._changed = (min(top, before[0]), max(bottom, before[1]), min(left, before[2]), max(right, before[3]))


def static_costs(cells: np.ndarray, params: CostmapParams) -> np.ndarray:
    """Return the costs, (rows, columns) uint8, of occupancies -1 to 100, as costmap_2d's static layer."""
    threshold = params.lethal_cost_threshold
    scaled = np.zeros(cells.shape) if params.trinary_costmap else float(LETHAL) * np.maximum(cells, 0) / threshold
    costs = np.where(cells >= threshold, LETHAL, scaled)
    return np.where(cells < 0, NO_INFORMATION if params.track_unknown_space else FREE, costs).astype(np.uint8)
