"""Kernels of a costmap's layers: obstacles that scans mark and clear, and inflation."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.distances import squared_distances

FREE = 0
INSCRIBED = 253  # the robot touches an obstacle whatever its heading
LETHAL = 254  # an obstacle
NO_INFORMATION = 255  # unknown space


def cost_table(limit: int, resolution_m: float, inscribed_radius_m: float, cost_scaling_factor: float) -> np.ndarray:
    """Return the cost by squared distance to the nearest obstacle in cells^2, up to `limit` cells: (n,) uint8.

    As costmap_2d's InflationLayer::computeCost: 252 exp(-factor (distance - inscribed radius)).
    """
    distance_m = np.sqrt(np.arange(limit * limit + 1)) * resolution_m
    decayed = (INSCRIBED - 1) * np.exp(np.minimum(-cost_scaling_factor * (distance_m - inscribed_radius_m), 0.0))
    costs = np.where(distance_m <= inscribed_radius_m, INSCRIBED, np.minimum(decayed, INSCRIBED))
    costs[0] = LETHAL
    return costs.astype(np.uint8)


def inflate(
    base: np.ndarray, costs: np.ndarray, table: np.ndarray, limit: int, top: int, bottom: int, left: int, right: int
) -> None:
    """Write the inflated costs of `base` into a window of `costs`, both (rows, columns) uint8.

    The window is that of changes, rows from `top` to before `bottom` and columns from `left` to before `right`, widened
    by the inflation radius of `limit` cells, to which `table` of `cost_table` reaches.
    """
    rows, columns = base.shape
    first_row, first_column = max(0, top - limit), max(0, left - limit)
    last_row, last_column = min(rows, bottom + limit), min(columns, right + limit)
    # Obstacles outside the window reach into it from up to a radius away.
    top, left = max(0, first_row - limit), max(0, first_column - limit)
    near = base[top : min(rows, last_row + limit), left : min(columns, last_column + limit)]
    squared = squared_distances(near == LETHAL, limit)
    _enter_inflation(base, costs, table, squared, top, left, first_row, last_row, first_column, last_column)


@compiled
def _enter_inflation(
    base: Array,
    costs: Array,
    table: Array,
    squared: Array,
    top: int,
    left: int,
    first_row: int,
    last_row: int,
    first_column: int,
    last_column: int,
) -> None:
    """Write costs into a window by squared distances, whose first cell is at `top`, `left` of the grids."""
    for row in range(first_row, last_row):
        for column in range(first_column, last_column):
            cost = base[row, column]
            distance = np.uintp(squared[row - top, column - left])
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


@compiled
def clear_and_mark(
    cells: Array,
    per_m: float,
    laser: Pose2D,
    ranges_m: Array,
    angle_min_rad: float,
    angle_increment_rad: float,
    range_min_m: float,
    range_max_m: float,
    raytrace_range_m: float,
    obstacle_range_m: float,
    inf_is_valid: bool,
    clears: bool,
    marks: bool,
) -> None:
    """Enter one scan into an obstacle layer `cells`, (rows, columns) uint8 with `per_m` cells in a metre.

    All rays clear before any marks, so that a ray that grazes an obstacle does not erase another ray's hit. The laser
    is in the grid's own frame. A range that is NaN or outside range_min to range_max is ignored; +inf clears up to
    raytrace_range if `inf_is_valid`.
    """
    rows, columns = cells.shape
    x_m, y_m, yaw_rad = laser
    row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
    clears = clears and 0 <= row < rows and 0 <= column < columns
    hits, hit_count = np.empty((len(ranges_m), 2), np.int64), 0
    last_row, last_column, last_is_longer = row, column, False
    for index in range(len(ranges_m)):
        range_m = ranges_m[index]
        is_valid = inf_is_valid if range_m == math.inf else range_min_m <= range_m <= range_max_m
        if not is_valid:
            continue
        bearing_rad = yaw_rad + angle_min_rad + index * angle_increment_rad
        sin_bearing, cos_bearing = math.sin(bearing_rad), math.cos(bearing_rad)
        if clears:
            reach_m = min(range_m, raytrace_range_m)
            to_row = math.floor((y_m + reach_m * sin_bearing) * per_m)
            to_column = math.floor((x_m + reach_m * cos_bearing) * per_m)
            is_longer = range_m > raytrace_range_m
            # Neighbouring rays that end in the same cell pass the same cells.
            if to_row != last_row or to_column != last_column or is_longer != last_is_longer:
                _clear_ray(cells, row, column, to_row, to_column, is_longer)
                last_row, last_column, last_is_longer = to_row, to_column, is_longer
        if range_m <= obstacle_range_m and range_m < math.inf:
            hits[hit_count, 0] = math.floor((y_m + range_m * sin_bearing) * per_m)
            hits[hit_count, 1] = math.floor((x_m + range_m * cos_bearing) * per_m)
            hit_count += 1
    for index in range(hit_count if marks else 0):
        row, column = hits[index]
        if 0 <= row < rows and 0 <= column < columns:
            cells[row, column] = LETHAL


@compiled
def clear_polygon(cells: Array, per_m: float, corners_m: Array) -> None:
    """Clear the cells inside a polygon (n, 2) in the grid's own frame, and those that its sides cross.

    The centres of the latter may lie outside, but they count in the cost of the robot's footprint.
    """
    rows, columns = cells.shape
    low_x = high_x = corners_m[0, 0]
    low_y = high_y = corners_m[0, 1]
    for index in range(1, len(corners_m)):
        low_x, high_x = min(low_x, corners_m[index, 0]), max(high_x, corners_m[index, 0])
        low_y, high_y = min(low_y, corners_m[index, 1]), max(high_y, corners_m[index, 1])
    first_row = max(0, math.floor(low_y * per_m))
    last_row = min(rows - 1, math.floor(high_y * per_m))
    first_column = max(0, math.floor(low_x * per_m))
    last_column = min(columns - 1, math.floor(high_x * per_m))
    crossed_m = np.empty(len(corners_m))
    for row in range(first_row, last_row + 1):
        count = _cross_sides((row + 0.5) / per_m, corners_m, crossed_m)
        for column in range(first_column, last_column + 1):
            if _is_inside((column + 0.5) / per_m, crossed_m, count):
                cells[row, column] = FREE
    row, column = math.floor(corners_m[-1, 1] * per_m), math.floor(corners_m[-1, 0] * per_m)
    for index in range(len(corners_m)):
        to_row = math.floor(corners_m[index, 1] * per_m)
        to_column = math.floor(corners_m[index, 0] * per_m)
        _clear_ray(cells, row, column, to_row, to_column, True)
        row, column = to_row, to_column


@compiled
def _cross_sides(y_m: float, corners_m: Array, crossed_m: Array) -> int:
    """Fill the x of the sides of a polygon (n, 2) at a y into an array (n,), and return how many there are."""
    count, before = 0, len(corners_m) - 1
    for index in range(len(corners_m)):
        x, y, x_before, y_before = corners_m[index, 0], corners_m[index, 1], corners_m[before, 0], corners_m[before, 1]
        if (y > y_m) != (y_before > y_m):
            crossed_m[count] = (x_before - x) * (y_m - y) / (y_before - y) + x
            count += 1
        before = index
    return count


@compiled
def _is_inside(x_m: float, crossed_m: Array, count: int) -> bool:
    """Return whether a point is before an odd number of the crossed sides, the first `count` of (n,)."""
    inside = False
    for index in range(count):
        if x_m < crossed_m[index]:
            inside = not inside
    return inside


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
