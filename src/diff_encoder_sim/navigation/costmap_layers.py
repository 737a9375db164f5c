"""Kernels of a costmap's layers: obstacles that scans mark and clear, and inflation."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.distances import squared_distances

FREE = 0
INSCRIBED = 253  # the robot touches an obstacle whatever its heading
LETHAL = 254  # an obstacle
NO_INFORMATION = 255  # unknown space

# Costs of a footprint that cannot stand there, as in upstream's CostmapModel.
IN_OBSTACLE, IN_UNKNOWN, OFF_MAP = -1.0, -2.0, -3.0


def cost_table(limit: int, resolution_m: float, inscribed_radius_m: float, cost_scaling_factor: float) -> np.ndarray:
    """Return the cost by squared distance to the nearest obstacle in cells^2, up to `limit` cells: (n,) uint8.

    As costmap_2d's InflationLayer::computeCost: 252 exp(-factor (distance - inscribed radius)).
    """
    distance_m = np.sqrt(np.arange(limit * limit + 1)) * resolution_m
    decayed = (INSCRIBED - 1) * np.exp(np.minimum(-cost_scaling_factor * (distance_m - inscribed_radius_m), 0.0))
    costs = np.where(distance_m <= inscribed_radius_m, INSCRIBED, np.minimum(decayed, INSCRIBED))
    costs[0] = LETHAL
    return costs.astype(np.uint8)


Window = Tuple[int, int, int, int]  # first row, row behind the last, first column, column behind the last


def inflate(base: np.ndarray, costs: np.ndarray, table: np.ndarray, limit: int, window: Window) -> None:
    """Write the inflated costs of `base` into a window of `costs`, both (rows, columns) uint8.

    The window is that of changes, widened by the inflation radius of `limit` cells, to which `table` of `cost_table`
    reaches.
    """
    top, bottom, left, right = _widened(window, limit, base.shape)
    # Obstacles outside the window reach into it from up to a radius away.
    first_row, end_row, first_column, end_column = _widened((top, bottom, left, right), limit, base.shape)
    near = base[first_row:end_row, first_column:end_column]
    squared = squared_distances(near == LETHAL, limit)
    _enter_inflation(base, costs, table, squared, first_row, first_column, (top, bottom, left, right))


def _widened(window: Window, by: int, shape: Tuple[int, ...]) -> Window:
    top, bottom, left, right = window
    return max(0, top - by), min(shape[0], bottom + by), max(0, left - by), min(shape[1], right + by)


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


# Added before a number is cut off, rounds it, halves down: farther from a half no line of 10^8 cells comes.
ROUNDING = 0.5 - 1e-9


class RayRules(NamedTuple):
    """Which rays change an obstacle layer, and how far."""

    raytrace_range_m: float
    obstacle_range_m: float
    inf_is_valid: bool
    clears: bool
    marks: bool


@compiled
def clear_and_mark(cells: Array, per_m: float, laser: Pose2D, scan: Scan, rules: RayRules) -> None:
    """Enter one scan into an obstacle layer `cells`, (rows, columns) uint8 with `per_m` cells in a metre.

    All rays clear before any marks, so that a ray that grazes an obstacle does not erase another ray's hit. The laser
    is in the grid's own frame. A range that is NaN or outside range_min to range_max is ignored; +inf clears up to
    raytrace_range if `inf_is_valid`.
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
    """Clear the cells inside a polygon (n, 2) in the grid's own frame, and those that its sides cross.

    The centres of the latter may lie outside, but they count in the cost of the robot's footprint.
    """
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
    """Clear the cells of a line (Bresenham) up to its end or the edge of the grid.

    In closed form, of which a processor computes several steps at once: the n-th cell of a line of `right` columns and
    fewer rows, `down`, is n down / right rows away, rounded, halves down.
    """
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
    if across <= cells_left:
        return along + 1
    return (2 * cells_left + 1) * along // (2 * across) + 1
