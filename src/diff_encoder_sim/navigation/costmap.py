"""Costs of cells as places for the robot's centre, in costmap_2d's layers: map, obstacles in scans, inflation."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid, squared_distances
from diff_encoder_sim.navigation.costmap_params import (
    FREE,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    CostmapParams,
    make_footprint,
)
from diff_encoder_sim.navigation.dwa_kernels import footprint_cost

# First row, row behind the last, first column, column behind the last.
Window = Tuple[int, int, int, int]


class RayRules(NamedTuple):
    """Which rays change an obstacle layer, and how far."""

    raytrace_range_m: float
    obstacle_range_m: float
    inf_is_valid: bool
    clears: bool
    marks: bool


class Costmap:
    """Layers over a static map, or over a rolling window around the robot, at first around (0, 0).

    All poses are in the costmap's frame: map for a static map, odom for a window. Raises ConfigError for an empty map.
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
            cells, walls_from = static_map.cells, params.lethal_cost_threshold
            scaled = 0.0 if params.trinary_costmap else float(LETHAL) * np.maximum(cells, 0) / walls_from
            unknown = NO_INFORMATION if params.track_unknown_space else FREE
            costs = np.where(cells < 0, unknown, np.where(cells >= walls_from, LETHAL, scaled))
            self._static = costs.astype(np.uint8)
            self._unseen = NO_INFORMATION  # cells without rays use the static map
        self.cells_per_m = 1.0 / self.resolution_m
        self._obstacles = np.full(self.shape, self._unseen, np.uint8)
        self._base, self._costs = np.empty(self.shape, np.uint8), np.empty(self.shape, np.uint8)
        # The inflation radius in cells, rounded up as upstream does.
        self._limit = max(0, math.ceil(params.inflation_radius / self.resolution_m - 1e-9))
        self._table = self._costs_by_distance()
        scan, ranges_m = params.scan, (params.raytrace_range, params.obstacle_range)
        self._rules = RayRules(*ranges_m, scan.inf_is_valid, scan.clearing, scan.marking)
        self._everything: Window = (0, self.shape[0], 0, self.shape[1])
        self._changed: Optional[Window] = self._everything  # not in `_costs` yet

    @property
    def costs(self) -> np.ndarray:
        """Return the costs, (rows, columns) uint8, inflated here when needed; an update changes them in place."""
        if self._changed is not None:
            base = self._obstacles
            if self._static is not None:  # the higher cost of map and obstacles where rays have been
                cells = slice(*self._changed[:2]), slice(*self._changed[2:])
                seen, walls, base = self._obstacles[cells], self._static[cells], self._base
                is_higher = (seen != NO_INFORMATION) & ((walls == NO_INFORMATION) | (seen > walls))
                base[cells] = np.where(is_higher, seen, walls)
            # Costs change up to the inflation radius away, where obstacles count from as far again.
            window = self._widened(self._changed)
            top, bottom, left, right = self._widened(window)
            squared = squared_distances(base[top:bottom, left:right] == LETHAL, self._limit)
            _enter_inflation(base, self._costs, self._table, squared, top, left, window)
            self._changed = None
        return self._costs

    def _widened(self, window: Window) -> Window:
        (top, bottom, left, right), (rows, columns), by = window, self.shape, self._limit
        return max(0, top - by), min(rows, bottom + by), max(0, left - by), min(columns, right + by)

    def _costs_by_distance(self) -> np.ndarray:
        """Return (n,) uint8 costs by squared distance [cells^2] to an obstacle, as InflationLayer::computeCost."""
        distance_m = np.sqrt(np.arange(self._limit**2 + 1)) * self.resolution_m
        inscribed_m = self.footprint.inscribed_radius_m
        decayed = np.exp(np.minimum(-self.params.cost_scaling_factor * (distance_m - inscribed_m), 0.0))
        costs = np.where(distance_m <= inscribed_m, INSCRIBED, (INSCRIBED - 1) * decayed)
        costs[0] = LETHAL
        return costs.astype(np.uint8)

    def _place(self, origin: Pose2D) -> None:
        self.origin, self._frame_in_grid = origin, origin.inverse()

    def pose_in_grid(self, pose: Pose2D) -> Pose2D:
        """Return a pose in the grid's own frame: x along columns, y along rows [m]."""
        return self._frame_in_grid.compose(pose)

    def cell_at(self, x_m: float, y_m: float) -> Tuple[int, int]:
        """Return (row, column) of the cell at a point; it may be outside the grid."""
        local = self.pose_in_grid(Pose2D(x_m, y_m, 0.0))
        return math.floor(local.y_m * self.cells_per_m), math.floor(local.x_m * self.cells_per_m)

    def cost_at(self, x_m: float, y_m: float) -> Optional[int]:
        """Return the cost of the cell at a point, None outside the grid."""
        (row, column), (rows, columns) = self.cell_at(x_m, y_m), self.shape
        return int(self.costs[row, column]) if 0 <= row < rows and 0 <= column < columns else None

    def footprint_cost(self, base_pose: Pose2D) -> float:
        """Return the highest cost under the robot's outline at a pose; IN_OBSTACLE, IN_UNKNOWN or OFF_MAP (< 0)."""
        x_m, y_m, yaw_rad = self.pose_in_grid(base_pose)
        place = x_m, y_m, math.cos(yaw_rad), math.sin(yaw_rad)
        return float(footprint_cost(self.costs, self.cells_per_m, self.footprint.vertices_m, place))

    def is_static_obstacle(self, x_m: float, y_m: float) -> bool:
        """Return whether the static map blocks the robot's centre at a point of the grid."""
        if self._static is None:
            return False
        away = np.argwhere(self._static == LETHAL) - self.cell_at(x_m, y_m)
        reach_m = np.hypot(*away.T).min(initial=math.inf) * self.resolution_m
        return bool(reach_m <= self.footprint.inscribed_radius_m)

    def update(self, base_pose: Pose2D, scan: Optional[Scan] = None, laser_pose: Optional[Pose2D] = None) -> None:
        """Centre the window on the robot, enter the newest scan by the laser's pose then, clear the footprint."""
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
        if params.observation_sources and (other.shape, other.resolution_m) == (self.shape, self.resolution_m):
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
        if down or right:
            (x_m, y_m, _), cell_m = self.origin, self.resolution_m
            self._place(Pose2D(x_m + right * cell_m, y_m + down * cell_m, 0.0))
            before, self._obstacles = self._obstacles, np.full_like(self._obstacles, self._unseen)
            if abs(down) < rows and abs(right) < columns:
                kept = before[max(0, down) : rows + min(0, down), max(0, right) : columns + min(0, right)]
                top, left = max(0, -down), max(0, -right)
                self._obstacles[top : top + kept.shape[0], left : left + kept.shape[1]] = kept

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


@compiled
def _enter_inflation(
    base: Array, costs: Array, table: Array, squared: Array, first_row: int, first_column: int, window: Window
) -> None:
    """Write costs into a window by squared distances, whose first cell is at a row and column of the grids."""
    top, bottom, left, right = window
    for row in range(top, bottom):
        for column in range(left, right):
            cost = base[row, column]
            distance = np.uintp(squared[row - first_row, column - first_column])
            if distance < len(table):
                inflated = table[distance]
                # Inflation marks unknown cells only within the inscribed radius of the obstacle.
                if cost != NO_INFORMATION:
                    cost = max(cost, inflated)
                elif inflated >= INSCRIBED:
                    cost = inflated
            costs[row, column] = cost


# Added before a number is cut off, rounds it, halves down: no line of 10^8 cells comes closer to a half.
ROUNDING = 0.5 - 1e-9


@compiled
def clear_and_mark(cells: Array, per_m: float, laser: Pose2D, scan: Scan, rules: RayRules) -> None:
    """Enter one scan into an obstacle layer `cells`, (rows, columns) uint8; the laser is in the grid's own frame.

    All rays clear before any marks, so that a ray that grazes an obstacle does not erase another ray's hit. A range
    that is NaN or outside range_min to range_max is ignored; +inf clears up to raytrace_range if `inf_is_valid`.
    """
    rows, columns = cells.shape
    x_m, y_m, yaw_rad = laser
    ranges_m = scan.ranges_m
    row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
    clears = rules.clears and 0 <= row < rows and 0 <= column < columns
    hits, hit_count = np.empty((len(ranges_m), 2), np.int64), 0
    last_row, last_column, last_is_longer = row, column, False
    for index in range(len(ranges_m)):
        range_m = ranges_m[index]
        is_valid = rules.inf_is_valid if range_m == math.inf else scan.range_min_m <= range_m <= scan.range_max_m
        if not is_valid:
            continue
        bearing_rad = yaw_rad + scan.angle_min_rad + index * scan.angle_increment_rad
        sin_bearing, cos_bearing = math.sin(bearing_rad), math.cos(bearing_rad)
        if clears:
            reach_m = min(range_m, rules.raytrace_range_m)
            to_row = math.floor((y_m + reach_m * sin_bearing) * per_m)
            to_column = math.floor((x_m + reach_m * cos_bearing) * per_m)
            is_longer = range_m > rules.raytrace_range_m
            # Neighbouring rays that end in the same cell pass the same cells.
            if to_row != last_row or to_column != last_column or is_longer != last_is_longer:
                _clear_ray(cells, row, column, to_row, to_column, is_longer)
                last_row, last_column, last_is_longer = to_row, to_column, is_longer
        if rules.marks and range_m <= rules.obstacle_range_m and range_m < math.inf:
            hits[hit_count, 0] = math.floor((y_m + range_m * sin_bearing) * per_m)
            hits[hit_count, 1] = math.floor((x_m + range_m * cos_bearing) * per_m)
            hit_count += 1
    for row, column in hits[:hit_count]:
        if 0 <= row < rows and 0 <= column < columns:
            cells[row, column] = LETHAL


@compiled
def clear_polygon(cells: Array, per_m: float, corners_m: Array) -> None:
    """Clear the cells inside a polygon (n, 2) in the grid's own frame, and those that its sides cross."""
    rows, columns = cells.shape
    xs, ys = corners_m[:, 0], corners_m[:, 1]
    for row in range(max(0, math.floor(ys.min() * per_m)), min(rows, math.floor(ys.max() * per_m) + 1)):
        for column in range(max(0, math.floor(xs.min() * per_m)), min(columns, math.floor(xs.max() * per_m) + 1)):
            x_m, y_m, is_inside = (column + 0.5) / per_m, (row + 0.5) / per_m, False
            for index in range(len(corners_m)):
                x, y, x_before, y_before = xs[index], ys[index], xs[index - 1], ys[index - 1]
                if (y > y_m) != (y_before > y_m) and x_m < (x_before - x) * (y_m - y) / (y_before - y) + x:
                    is_inside = not is_inside
            if is_inside:
                cells[row, column] = FREE
    for index in range(len(corners_m)):
        row, column = math.floor(ys[index - 1] * per_m), math.floor(xs[index - 1] * per_m)
        _clear_ray(cells, row, column, math.floor(ys[index] * per_m), math.floor(xs[index] * per_m), True)


@compiled
def _clear_ray(cells: Array, row: int, column: int, to_row: int, to_column: int, with_end: bool) -> None:
    """Clear the cells of a line (Bresenham) to its end or the edge of the grid, in closed form, rounded half down."""
    rows, columns = cells.shape
    if not (0 <= row < rows and 0 <= column < columns):
        return
    down, right = abs(to_row - row), abs(to_column - column)
    row_step = 1 if to_row > row else -1
    column_step = 1 if to_column > column else -1
    rows_left = rows - 1 - row if row_step > 0 else row
    columns_left = columns - 1 - column if column_step > 0 else column
    # The cell of the hit itself stays as it was: the ray has not passed through it.
    count = max(down, right) + with_end
    if right >= down:
        count = min(count, columns_left + 1, _count_within(rows_left, down, right))
        slope = down / max(right, 1)
        for n in range(count):
            cells[np.uintp(row + row_step * int(n * slope + ROUNDING)), np.uintp(column + column_step * n)] = FREE
    else:
        count = min(count, rows_left + 1, _count_within(columns_left, right, down))
        slope = right / down
        for n in range(count):
            cells[np.uintp(row + row_step * n), np.uintp(column + column_step * int(n * slope + ROUNDING))] = FREE


@compiled
def _count_within(cells_left: int, across: int, along: int) -> int:
    """Return the number of cells of a line of slope `across`/`along` with at most `cells_left` across."""
    return along + 1 if across <= cells_left else (2 * cells_left + 1) * along // (2 * across) + 1
