"""Kernels of the obstacle layer: clear cells along rays and outlines, mark where rays end."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.cost_values import FREE, LETHAL

# Added before a number is cut off, rounds it, halves down: farther from a half no line of 10^8 cells comes.
ROUNDING = 0.5 - 1e-9


@compiled
def clear_and_mark(
    cells: np.ndarray,
    per_m: float,
    x_m: float,
    y_m: float,
    yaw_rad: float,
    angle_min_rad: float,
    angle_increment_rad: float,
    ranges_m: np.ndarray,
    range_min_m: float,
    range_max_m: float,
    raytrace_range_m: float,
    obstacle_range_m: float,
    inf_is_valid: bool,
    clears: bool,
    marks: bool,
) -> None:
    """Enter one scan into an obstacle layer `cells`, (rows, columns) uint8 with `per_m` cells in a metre.

    All rays clear before any marks, so that a ray that grazes an obstacle does not erase another ray's hit. x_m,
    y_m, yaw_rad is the laser in the grid's own frame. A range that is NaN or outside range_min to range_max is
    ignored; +inf clears up to raytrace_range if `inf_is_valid`.
    """
    rows, columns = cells.shape
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
    if marks:
        _mark(cells, hits[:hit_count])


@compiled
def _mark(cells: np.ndarray, hits: np.ndarray) -> None:
    """Mark the cells of `hits`, (n, 2) row and column, that are on the grid."""
    for index in range(len(hits)):
        row, column = hits[index]
        if 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
            cells[row, column] = LETHAL


@compiled
def clear_outline(cells: np.ndarray, per_m: float, corners_m: np.ndarray) -> None:
    """Clear the cells that the sides of a polygon (n, 2) cross, given in the grid's own frame.

    Their centres may lie outside the polygon, but they count in the cost of the robot's footprint.
    """
    row, column = math.floor(corners_m[-1, 1] * per_m), math.floor(corners_m[-1, 0] * per_m)
    for index in range(len(corners_m)):
        to_row = math.floor(corners_m[index, 1] * per_m)
        to_column = math.floor(corners_m[index, 0] * per_m)
        _clear_ray(cells, row, column, to_row, to_column, True)
        row, column = to_row, to_column


@compiled
def _clear_ray(cells: np.ndarray, row: int, column: int, to_row: int, to_column: int, with_end: bool) -> None:
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
    """Return how many cells of a line that goes `across` while it goes `along` are no more than `cells_left` across."""
    if across <= cells_left:
        return along + 1
    return (2 * cells_left + 1) * along // (2 * across) + 1
