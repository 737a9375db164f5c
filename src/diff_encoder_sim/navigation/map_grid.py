"""Distances over the free cells of a costmap from a plan, or from its last point in sight.

base_local_planner's MapGrid: a wavefront over the four neighbours, in cells.
"""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from diff_encoder_sim.navigation.footprint import NO_INFORMATION
from diff_encoder_sim.navigation.inflation import INSCRIBED


@njit(cache=True)
def plan_distance(costs: np.ndarray, per_m: float, plan_m: np.ndarray, only_end: bool,
                  distance: np.ndarray) -> bool:
    """Fill `distance` (rows, columns) int32; False where no point of the plan is on known cells.

    Cells that block the robot's centre get the number of cells, cells that the wave does not
    reach one more: both are farther than any way around.

    Args:
        costs: (rows, columns) uint8 costmap.
        per_m: cells in a metre.
        plan_m: (n, 2) x, y in the grid's own frame.
        only_end: start from the last point before the plan leaves the grid, not from all of it.
    """
    rows, columns = costs.shape
    blocked, unreached = rows * columns, rows * columns + 1
    distance[:, :] = unreached
    queue = np.empty(rows * columns, np.int32)
    filled = _seed(costs, per_m, plan_m, only_end, distance, queue)
    if filled == 0:
        return False
    taken = 0
    while taken < filled:
        row, column = queue[taken] // columns, queue[taken] % columns
        taken += 1
        farther = distance[row, column] + 1
        for side in range(4):
            to_row = row + (side == 0) - (side == 1)
            to_column = column + (side == 2) - (side == 3)
            if 0 <= to_row < rows and 0 <= to_column < columns \
                    and distance[to_row, to_column] == unreached:
                if costs[to_row, to_column] >= INSCRIBED:
                    distance[to_row, to_column] = blocked
                else:
                    distance[to_row, to_column] = farther
                    queue[filled] = to_row * columns + to_column
                    filled += 1
    return True


@njit(cache=True)
def _seed(costs: np.ndarray, per_m: float, plan_m: np.ndarray, only_end: bool,
          distance: np.ndarray, queue: np.ndarray) -> int:
    """Put the plan's cells at distance 0 into the queue; returns how many."""
    rows, columns = costs.shape
    filled, end = 0, -1
    for index in range(len(plan_m)):
        before = max(0, index - 1)
        x_step = plan_m[index, 0] - plan_m[before, 0]
        y_step = plan_m[index, 1] - plan_m[before, 1]
        # No gaps between the points wider than a cell.
        steps = max(1, math.ceil(math.sqrt(x_step * x_step + y_step * y_step) * per_m))
        for step in range(1, steps + 1):
            row = math.floor((plan_m[before, 1] + y_step * step / steps) * per_m)
            column = math.floor((plan_m[before, 0] + x_step * step / steps) * per_m)
            if 0 <= row < rows and 0 <= column < columns \
                    and costs[row, column] != NO_INFORMATION:
                end = row * columns + column
                if not only_end and distance[row, column] != 0:
                    distance[row, column] = 0
                    queue[filled] = end
                    filled += 1
            elif end >= 0:
                return _finish_seed(only_end, end, filled, columns, distance, queue)
    return _finish_seed(only_end, end, filled, columns, distance, queue)


@njit(cache=True)
def _finish_seed(only_end: bool, end: int, filled: int, columns: int, distance: np.ndarray,
                 queue: np.ndarray) -> int:
    if only_end and end >= 0:
        distance[end // columns, end % columns] = 0
        queue[0] = end
        return 1
    return filled
