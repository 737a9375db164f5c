"""Costs of standing on a costmap and of driving a trajectory over it: kernels of critics.py.

Kernels take what they need of a Scene one by one: to take an array out of a tuple counts a reference to it, which costs
as much as to score a point.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.cost_values import LETHAL
from diff_encoder_sim.navigation.critics import (
    ALIGNMENT,
    BLOCKED,
    CENTRE_OFF_MAP,
    COLLIDES,
    CRITICS,
    GOAL,
    GOAL_FRONT,
    OBSTACLE,
    OFF_MAP,
    PATH,
    TWIRLING,
    UNREACHABLE,
)
from diff_encoder_sim.navigation.footprint import IN_OBSTACLE, IN_UNKNOWN
from diff_encoder_sim.navigation.footprint import OFF_MAP as FOOTPRINT_OFF_MAP
from diff_encoder_sim.navigation.plan_distances import TO_END, TO_FRONT, TO_PLAN, Waves, distance_to

# A point that is off by rounding alone is in the same cell if it is farther from that cell's edges [cells].
ROUNDING_CELLS = 1e-6


class Scene(NamedTuple):
    """What trajectories are scored against."""

    costs: np.ndarray  # (rows, columns) uint8 costmap
    per_m: float  # cells in a metre
    vertices_m: np.ndarray  # (n, 2) footprint in base_link
    waves: Waves  # from the plan
    nose_m: float  # from the robot's centre to its nose
    scales: np.ndarray  # (7,) weights of the critics, none below zero
    sums_obstacle: bool  # over a trajectory; else the highest counts


@compiled
def footprint_cost(
    costs: np.ndarray, per_m: float, vertices_m: np.ndarray, x_m: float, y_m: float, cos_yaw: float, sin_yaw: float
) -> float:
    """Return the highest cost under the outline of a footprint, or a reason (< 0) why it cannot stand there.

    x_m, y_m, cos_yaw, sin_yaw is base_link in the grid's own frame. Only the outline is looked at: an obstacle that
    moves inside must cross it.
    """
    highest = 0.0
    last = len(vertices_m) - 1
    row = math.floor((y_m + sin_yaw * vertices_m[last, 0] + cos_yaw * vertices_m[last, 1]) * per_m)
    column = math.floor((x_m + cos_yaw * vertices_m[last, 0] - sin_yaw * vertices_m[last, 1]) * per_m)
    for index in range(len(vertices_m)):
        to_row = math.floor((y_m + sin_yaw * vertices_m[index, 0] + cos_yaw * vertices_m[index, 1]) * per_m)
        to_column = math.floor((x_m + cos_yaw * vertices_m[index, 0] - sin_yaw * vertices_m[index, 1]) * per_m)
        cost = line_cost(costs, row, column, to_row, to_column)
        if cost < 0.0:
            return cost
        highest = max(highest, cost)
        row, column = to_row, to_column
    return highest


@compiled
def line_cost(costs: np.ndarray, row: int, column: int, to_row: int, to_column: int) -> float:
    """Return the highest cost on a line of cells (Bresenham), or a reason (< 0) as `footprint_cost`."""
    rows, columns = costs.shape
    if not (0 <= row < rows and 0 <= to_row < rows and 0 <= column < columns and 0 <= to_column < columns):
        return FOOTPRINT_OFF_MAP
    down, right = abs(to_row - row), abs(to_column - column)
    row_step = 1 if to_row > row else -1
    column_step = 1 if to_column > column else -1
    error = right - down
    highest = 0
    while True:
        cost = costs[row, column]
        if cost >= LETHAL:
            return IN_OBSTACLE if cost == LETHAL else IN_UNKNOWN
        highest = max(highest, cost)
        if row == to_row and column == to_column:
            return float(highest)
        doubled = 2 * error
        if doubled > -down:
            error -= down
            column += column_step
        if doubled < right:
            error += right
            row += row_step


@compiled
def stays_clear(costs: np.ndarray, per_m: float, vertices_m: np.ndarray, points: np.ndarray) -> bool:
    """Return whether the robot can stand at every point (n, 5) of `roll_out`, in the grid's own frame."""
    rows, columns = costs.shape
    for index in range(len(points)):
        row, column = math.floor(points[index, 1] * per_m), math.floor(points[index, 0] * per_m)
        if not (0 <= row < rows and 0 <= column < columns):
            return False
        x_m, y_m, cos_yaw, sin_yaw = points[index, 0], points[index, 1], points[index, 3], points[index, 4]
        if footprint_cost(costs, per_m, vertices_m, x_m, y_m, cos_yaw, sin_yaw) < 0.0:
            return False
    return True


@compiled
def score_trajectory(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    cells: np.ndarray,
    queues: np.ndarray,
    counts: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    sums_obstacle: bool,
    turn_radps: float,
    points: np.ndarray,
    steps: int,
    most: float,
    scores: np.ndarray,
) -> float:
    """Return the weighted sum of a trajectory's costs, below zero where it is rejected; fill `scores` (7,) by critic.

    The first nine arguments are those of Scene and its waves. The trajectory is the first `steps` > 0 of `points`
    (n, 5) of `roll_out` in the grid's own frame. From the end backwards, as obstacles are ahead, and no further than
    to a sum above `most`.
    """
    total, scores[:] = 0.0, 0.0
    scores[TWIRLING] = abs(turn_radps)
    for index in range(steps - 1, -1, -1):
        x_m, y_m, cos_yaw, sin_yaw = points[index, 0], points[index, 1], points[index, 3], points[index, 4]
        obstacle = standing_cost(costs, per_m, vertices_m, scales, x_m, y_m, cos_yaw, sin_yaw)
        is_last = index == steps - 1
        if obstacle < 0.0 and is_last:
            scores[OBSTACLE] = obstacle
        if obstacle < 0.0:
            return obstacle
        scores[OBSTACLE] = scores[OBSTACLE] + obstacle if sums_obstacle else max(scores[OBSTACLE], obstacle)
        x_nose_m, y_nose_m = x_m + nose_m * cos_yaw, y_m + nose_m * sin_yaw
        reason = _score_distances(
            costs, per_m, cells, queues, counts, scales, x_m, y_m, x_nose_m, y_nose_m, is_last, scores
        )
        total = reason if reason < 0.0 else _total(scores, scales)
        if total < 0.0 or total > most:
            break
    return total


@compiled
def standing_cost(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    scales: np.ndarray,
    x_m: float,
    y_m: float,
    cos_yaw: float,
    sin_yaw: float,
) -> float:
    """Return the highest cost under the outline and in the centre's cell, below zero if that rejects.

    Without a weight of the obstacle critic it is 0 everywhere on the grid.
    """
    rows, columns = costs.shape
    row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
    if not (0 <= row < rows and 0 <= column < columns):
        return CENTRE_OFF_MAP
    if scales[OBSTACLE] == 0.0:
        return 0.0
    cost = footprint_cost(costs, per_m, vertices_m, x_m, y_m, cos_yaw, sin_yaw)
    return COLLIDES if cost < 0.0 else max(cost, float(costs[row, column]))


@compiled
def least_cost(
    costs: np.ndarray,
    per_m: float,
    cells: np.ndarray,
    queues: np.ndarray,
    counts: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    turn_radps: float,
    obstacle: float,
    x_m: float,
    y_m: float,
    yaw_rad: float,
    scores: np.ndarray,
) -> float:
    """Return the least that a trajectory can cost which ends at a point, inf if it must be rejected.

    Distances count at the end, and one of its places costs `obstacle`. The point may be off by rounding: where that
    decides on a cell, the answer is 0. `scores` (7,) is for the work.
    """
    rows, columns = costs.shape
    x_nose_m, y_nose_m = x_m + nose_m * math.cos(yaw_rad), y_m + nose_m * math.sin(yaw_rad)
    for along_m in (x_m, y_m, x_nose_m, y_nose_m):
        if abs(along_m * per_m - math.floor(along_m * per_m + 0.5)) < ROUNDING_CELLS:
            return 0.0
    if not (0 <= math.floor(y_m * per_m) < rows and 0 <= math.floor(x_m * per_m) < columns):
        return math.inf
    scores[:] = 0.0
    scores[OBSTACLE], scores[TWIRLING] = obstacle, abs(turn_radps)
    reason = _score_distances(costs, per_m, cells, queues, counts, scales, x_m, y_m, x_nose_m, y_nose_m, True, scores)
    return _total(scores, scales) if reason >= 0.0 else math.inf


@compiled
def _score_distances(
    costs: np.ndarray,
    per_m: float,
    cells: np.ndarray,
    queues: np.ndarray,
    counts: np.ndarray,
    scales: np.ndarray,
    x_m: float,
    y_m: float,
    x_nose_m: float,
    y_nose_m: float,
    is_last: bool,
    scores: np.ndarray,
) -> float:
    """Return the reason (< 0) to reject a place on the grid; enter the distances of the last in `scores` (7,)."""
    rows, columns = costs.shape
    size, row, column = rows * columns, math.floor(y_m * per_m), math.floor(x_m * per_m)
    for critic, layer in ((PATH, TO_PLAN), (GOAL, TO_END)):
        if scales[critic] != 0.0:
            distance = distance_to(cells, queues, counts, layer, size, columns, row, column)
            cost = float(distance) if distance < size else BLOCKED if distance == size else UNREACHABLE
            if is_last:
                scores[critic] = cost
            if cost < 0.0:
                return cost
    row, column = math.floor(y_nose_m * per_m), math.floor(x_nose_m * per_m)
    # The nose may look into obstacles: that has a cost, but does not reject.
    for critic, layer in ((GOAL_FRONT, TO_FRONT), (ALIGNMENT, TO_PLAN)):
        if scales[critic] != 0.0:
            is_on_map = 0 <= row < rows and 0 <= column < columns
            if is_last:
                scores[critic] = OFF_MAP
                if is_on_map:
                    scores[critic] = distance_to(cells, queues, counts, layer, size, columns, row, column)
            if not is_on_map:
                return OFF_MAP
    return 0.0


@compiled
def _total(scores: np.ndarray, scales: np.ndarray) -> float:
    """Return the weighted sum of costs (7,), or the first that is below zero."""
    total = 0.0
    for critic in range(CRITICS):
        if scores[critic] < 0.0:
            return float(scores[critic])
        total += scales[critic] * scores[critic]
    return total
