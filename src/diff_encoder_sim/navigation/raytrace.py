"""The obstacle layer's update from a scan: clear along each ray, then mark its end."""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from diff_encoder_sim.navigation.footprint import LETHAL

FREE = 0


@njit(cache=True)
def clear_and_mark(cells: np.ndarray, per_m: float, x_m: float, y_m: float, yaw_rad: float,
                   angle_min_rad: float, angle_increment_rad: float, ranges_m: np.ndarray,
                   range_min_m: float, range_max_m: float, raytrace_range_m: float,
                   obstacle_range_m: float, inf_is_valid: bool, clears: bool,
                   marks: bool) -> None:
    """Enter one scan into an obstacle layer.

    All rays clear before any marks: a ray that grazes what another one hit must not erase it. A
    range that is not a number, below range_min or above range_max says nothing.

    Args:
        cells: (rows, columns) uint8, changed in place.
        per_m: cells in a metre.
        x_m, y_m, yaw_rad: the laser in the grid's own frame.
        ranges_m: (n,) as in Scan.
        inf_is_valid: whether +inf means free up to raytrace_range.
    """
    row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
    if clears and 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
        for index in range(len(ranges_m)):
            range_m = ranges_m[index]
            is_empty = range_m == math.inf
            if is_empty and not inf_is_valid:
                continue
            if is_empty or (range_min_m <= range_m <= range_max_m):
                bearing_rad = yaw_rad + angle_min_rad + index * angle_increment_rad
                reach_m = min(range_m, raytrace_range_m)
                _clear_ray(cells, row, column,
                           math.floor((y_m + reach_m * math.sin(bearing_rad)) * per_m),
                           math.floor((x_m + reach_m * math.cos(bearing_rad)) * per_m),
                           range_m > raytrace_range_m)
    if marks:
        for index in range(len(ranges_m)):
            range_m = ranges_m[index]
            if range_min_m <= range_m <= min(range_max_m, obstacle_range_m):
                bearing_rad = yaw_rad + angle_min_rad + index * angle_increment_rad
                row = math.floor((y_m + range_m * math.sin(bearing_rad)) * per_m)
                column = math.floor((x_m + range_m * math.cos(bearing_rad)) * per_m)
                if 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
                    cells[row, column] = LETHAL


@njit(cache=True)
def _clear_ray(cells: np.ndarray, row: int, column: int, to_row: int, to_column: int,
               with_end: bool) -> None:
    """Free the cells of a line (Bresenham) up to its end or the edge of the grid."""
    rows, columns = cells.shape
    down, right = abs(to_row - row), abs(to_column - column)
    row_step = 1 if to_row > row else -1
    column_step = 1 if to_column > column else -1
    error = right - down
    while 0 <= row < rows and 0 <= column < columns:
        at_end = row == to_row and column == to_column
        # The cell of the hit itself stays what it was: no ray has passed it.
        if not at_end or with_end:
            cells[row, column] = FREE
        if at_end:
            return
        doubled = 2 * error
        if doubled > -down:
            error -= down
            column += column_step
        if doubled < right:
            error += right
            row += row_step
