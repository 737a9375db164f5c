"""Distances over the free cells of a costmap from a plan, or from its last point in the window.

base_local_planner's MapGrid: a wavefront over the four neighbours, in cells.
"""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.cost_values import INSCRIBED, NO_INFORMATION

# Layers of `fill_distance_grids`.
TO_PLAN, TO_END, TO_FRONT = range(3)


@compiled
def fill_distance_grids(
    costs: np.ndarray,
    per_m: float,
    origin: np.ndarray,
    plan: np.ndarray,
    base: np.ndarray,
    nose_m: float,
    grids: np.ndarray,
) -> bool:
    """Fill `grids` (3, rows, columns) int32: cells to the plan, to its end, to the nose's goal beyond it.

    The plan (n, 3), n > 0, is in the frame of the grid's `origin` (3,); `base` (3,) is the robot in the grid's own
    frame, its nose `nose_m` ahead of its centre. Returns False as `fill_distance_grid`.
    """
    cos_yaw, sin_yaw = math.cos(origin[2]), math.sin(origin[2])
    plan_m = np.empty((len(plan), 2))
    for index in range(len(plan)):
        x_m, y_m = plan[index, 0] - origin[0], plan[index, 1] - origin[1]
        plan_m[index, 0] = x_m * cos_yaw + y_m * sin_yaw
        plan_m[index, 1] = y_m * cos_yaw - x_m * sin_yaw
    front_m = plan_m.copy()
    # The nose's goal is beyond the goal as seen from the robot, not along the goal's heading, which would swing
    # around when the robot must turn at the end.
    bearing_rad = math.atan2(plan_m[-1, 1] - base[1], plan_m[-1, 0] - base[0])
    front_m[-1, 0] += nose_m * math.cos(bearing_rad)
    front_m[-1, 1] += nose_m * math.sin(bearing_rad)
    return (
        fill_distance_grid(costs, per_m, plan_m, False, grids[TO_PLAN])
        and fill_distance_grid(costs, per_m, plan_m, True, grids[TO_END])
        and fill_distance_grid(costs, per_m, front_m, True, grids[TO_FRONT])
    )


@compiled
def fill_distance_grid(
    costs: np.ndarray, per_m: float, plan_m: np.ndarray, only_end: bool, distance: np.ndarray
) -> bool:
    """Fill `distance` (rows, columns) int32 over a costmap; return False if no point of the plan is on known cells.

    The plan (n, 2) is in the grid's own frame; `only_end` starts the wave from the last point before it leaves the
    grid. Cells that block the robot's centre get the number of cells, unreached cells one more, both farther than any
    path.
    """
    rows, columns = costs.shape
    blocked, unreached = rows * columns, rows * columns + 1
    distance[:, :] = unreached
    queue = np.empty(rows * columns, np.int32)
    filled = _seed(costs, per_m, plan_m, only_end, distance, queue)
    if filled == 0:
        return False
    # A fence around the grid spares the wave the check for its edge.
    wide = columns + 2
    fenced = np.full((rows + 2) * wide, blocked, np.int32)
    is_free = np.zeros((rows + 2) * wide, np.bool_)
    for row in range(rows):
        first = (row + 1) * wide + 1
        fenced[first : first + columns] = distance[row]
        is_free[first : first + columns] = costs[row] < INSCRIBED
    for place in range(filled):
        row, column = queue[place] // columns, queue[place] % columns
        queue[place] = (row + 1) * wide + column + 1
    _spread(fenced, is_free, wide, blocked, queue, filled)
    for row in range(rows):
        first = (row + 1) * wide + 1
        distance[row] = fenced[first : first + columns]
    return True


@compiled
def _spread(fenced: np.ndarray, is_free: np.ndarray, wide: int, blocked: int, queue: np.ndarray, filled: int) -> None:
    """Run the wave over a flat grid, `wide` cells a row, from the cells in the queue."""
    unreached = blocked + 1
    taken = 0
    while taken < filled:
        cell = queue[taken]
        taken += 1
        farther = fenced[cell] + 1
        for step in (-wide, wide, -1, 1):
            to_cell = cell + step
            if fenced[to_cell] == unreached:
                if is_free[to_cell]:
                    fenced[to_cell] = farther
                    queue[filled] = to_cell
                    filled += 1
                else:
                    fenced[to_cell] = blocked


@compiled
def _seed(
    costs: np.ndarray, per_m: float, plan_m: np.ndarray, only_end: bool, distance: np.ndarray, queue: np.ndarray
) -> int:
    """Put the plan's cells at distance 0 into the queue; return their number."""
    rows, columns = costs.shape
    filled, end = 0, -1
    for index in range(len(plan_m)):
        before = max(0, index - 1)
        x_step = plan_m[index, 0] - plan_m[before, 0]
        y_step = plan_m[index, 1] - plan_m[before, 1]
        # Points farther apart than a cell leave no gaps.
        steps = max(1, math.ceil(math.sqrt(x_step * x_step + y_step * y_step) * per_m))
        for step in range(1, steps + 1):
            row = math.floor((plan_m[before, 1] + y_step * step / steps) * per_m)
            column = math.floor((plan_m[before, 0] + x_step * step / steps) * per_m)
            if 0 <= row < rows and 0 <= column < columns and costs[row, column] != NO_INFORMATION:
                end = row * columns + column
                if not only_end and distance[row, column] != 0:
                    distance[row, column] = 0
                    queue[filled] = end
                    filled += 1
            elif end >= 0:
                return _finish_seed(only_end, end, filled, columns, distance, queue)
    return _finish_seed(only_end, end, filled, columns, distance, queue)


@compiled
def _finish_seed(only_end: bool, end: int, filled: int, columns: int, distance: np.ndarray, queue: np.ndarray) -> int:
    """Put the plan's end into the queue if only that is wanted; return the number of cells in the queue."""
    if only_end and end >= 0:
        distance[end // columns, end % columns] = 0
        queue[0] = end
        return 1
    return filled
