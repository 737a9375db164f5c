"""What it costs to stand somewhere on a costmap, or to drive a trajectory over it.

The critics of critics.py, all samples in one kernel. It searches best first: no point of a
trajectory costs less than nothing, so that its end alone says how much it costs at least, and most
samples need not be looked at any further. The kernels share this file because numba's cache on disk
does not see changes in another one.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from diff_encoder_sim.navigation.critics import (
    ALIGNMENT,
    BLOCKED,
    CENTRE_OFF_MAP,
    COLLIDES,
    CRITICS,
    GOAL,
    GOAL_FRONT,
    NO_TRAJECTORY,
    OBSTACLE,
    OFF_MAP,
    OSCILLATES,
    OSCILLATION,
    PATH,
    TWIRLING,
    UNREACHABLE,
)
from diff_encoder_sim.navigation.footprint import IN_OBSTACLE, IN_UNKNOWN, LETHAL
from diff_encoder_sim.navigation.footprint import OFF_MAP as OUTLINE_OFF_MAP
from diff_encoder_sim.navigation.plan_distances import TO_END, TO_FRONT, TO_PLAN


@njit(cache=True)
def outline_cost(
    costs: np.ndarray, per_m: float, vertices_m: np.ndarray, x_m: float, y_m: float, cos_yaw: float, sin_yaw: float
) -> float:
    """Highest cost under the footprint's outline, or why there is none (< 0).

    Only the outline is looked at: an obstacle that is to get inside must cross it.

    Args:
        costs: (rows, columns) uint8 costmap.
        per_m: cells in a metre.
        vertices_m: (n, 2) corners in base_link.
        x_m, y_m, cos_yaw, sin_yaw: base_link in the grid's own frame.
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


@njit(cache=True)
def line_cost(costs: np.ndarray, row: int, column: int, to_row: int, to_column: int) -> float:
    """Highest cost on a line of cells (Bresenham), or why there is none (< 0)."""
    rows, columns = costs.shape
    if not (0 <= row < rows and 0 <= to_row < rows and 0 <= column < columns and 0 <= to_column < columns):
        return OUTLINE_OFF_MAP
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


@njit(cache=True)
def stays_clear(costs: np.ndarray, per_m: float, vertices_m: np.ndarray, points: np.ndarray) -> bool:
    """Whether the robot can stand at every point (n, 3) of a trajectory, in the grid's frame."""
    rows, columns = costs.shape
    for index in range(len(points)):
        row, column = math.floor(points[index, 1] * per_m), math.floor(points[index, 0] * per_m)
        if (
            not (0 <= row < rows and 0 <= column < columns)
            or _standing_cost(costs, per_m, vertices_m, points[index], row, column) < 0.0
        ):
            return False
    return True


@njit(cache=True)
def _standing_cost(
    costs: np.ndarray, per_m: float, vertices_m: np.ndarray, point: np.ndarray, row: int, column: int
) -> float:
    """Highest cost under the outline at x, y, yaw and in the centre's cell; or COLLIDES."""
    cost = outline_cost(costs, per_m, vertices_m, point[0], point[1], math.cos(point[2]), math.sin(point[2]))
    return COLLIDES if cost < 0.0 else max(cost, float(costs[row, column]))


@njit(cache=True)
def score_samples(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    grids: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    sums_obstacle: bool,
    samples: np.ndarray,
    points: np.ndarray,
    steps: np.ndarray,
    allowed: np.ndarray,
    scores_all: bool,
    scores: np.ndarray,
    totals: np.ndarray,
) -> int:
    """Find the cheapest sample, the first of equals; returns its index, -1 for none.

    Args:
        costs: (rows, columns) uint8 costmap; per_m: cells in a metre.
        vertices_m: (n, 2) the robot's outline in base_link.
        grids: (3, rows, columns) int32, of plan_distances.plan_distances.
        nose_m: from the robot's centre to its nose.
        scales: (7,) weights of the critics, none below zero.
        samples: (n, 2) linear [m/s], angular [rad/s].
        points: (n, most, 3) x, y, yaw of each, in the grid's own frame; steps: (n,) how many.
        allowed: (4,) bool, whether forward, backward, left and right are.
        scores_all: also those that cannot win; else what is told of them is of their ends.
        scores: (n, 7), filled with the critics' costs, unscaled; totals: (n,), with the sums.
    """
    bounds = np.full(len(samples), math.inf)
    for index in range(len(samples)):
        _score_end(
            costs,
            per_m,
            vertices_m,
            grids,
            nose_m,
            scales,
            samples[index],
            points[index, : steps[index]],
            allowed,
            scores[index],
        )
        totals[index] = _total(scores[index], scales) if steps[index] > 0 else NO_TRAJECTORY
        if totals[index] >= 0.0:
            bounds[index] = totals[index]
    best, least = -1, math.inf
    for _ in range(len(samples)):
        index = np.argmin(bounds)
        if bounds[index] == math.inf or (bounds[index] > least and not scores_all):
            break
        bounds[index] = math.inf
        total = _score_way(
            costs,
            per_m,
            vertices_m,
            grids,
            nose_m,
            scales,
            sums_obstacle,
            points[index, : steps[index]],
            math.inf if scores_all else least,
            scores[index],
        )
        totals[index] = total
        if 0.0 <= total < least or (total == least and index < best):
            best, least = index, total
    return best


@njit(cache=True)
def _score_end(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    grids: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    sample: np.ndarray,
    points: np.ndarray,
    allowed: np.ndarray,
    scores: np.ndarray,
) -> None:
    """Fill `scores` (7,) with what the critics say of a sample and of the last of its points."""
    scores[:] = 0.0
    scores[TWIRLING] = abs(sample[1])
    if (
        (sample[0] > 0 and not allowed[0])
        or (sample[0] < 0 and not allowed[1])
        or (sample[1] > 0 and not allowed[2])
        or (sample[1] < 0 and not allowed[3])
    ):
        scores[OSCILLATION] = OSCILLATES
    elif len(points) > 0:
        _score_point(costs, per_m, vertices_m, grids, nose_m, scales, points[-1], scores)


@njit(cache=True)
def _score_way(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    grids: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    sums_obstacle: bool,
    points: np.ndarray,
    most: float,
    scores: np.ndarray,
) -> float:
    """The total of a trajectory whose end is scored; enters the other points into `scores`.

    From the end backwards, as obstacles are ahead, and no further than to a total above `most`.
    """
    total = _total(scores, scales)
    here = np.zeros(CRITICS)
    for index in range(len(points) - 2, -1, -1):
        if total < 0.0 or total > most:
            break
        _score_point(costs, per_m, vertices_m, grids, nose_m, scales, points[index], here)
        scores[OBSTACLE] = scores[OBSTACLE] + here[OBSTACLE] if sums_obstacle else max(scores[OBSTACLE], here[OBSTACLE])
        total = _total(here, scales)
        if total >= 0.0:
            total = _total(scores, scales)
    return total


@njit(cache=True)
def _score_point(
    costs: np.ndarray,
    per_m: float,
    vertices_m: np.ndarray,
    grids: np.ndarray,
    nose_m: float,
    scales: np.ndarray,
    point: np.ndarray,
    scores: np.ndarray,
) -> None:
    """Fill `scores` (7,) with the costs of one place, up to the first that is below zero."""
    rows, columns = costs.shape
    blocked = rows * columns
    row, column = math.floor(point[1] * per_m), math.floor(point[0] * per_m)
    if not (0 <= row < rows and 0 <= column < columns):
        scores[OBSTACLE] = CENTRE_OFF_MAP
        return
    if scales[OBSTACLE] != 0.0:
        scores[OBSTACLE] = _standing_cost(costs, per_m, vertices_m, point, row, column)
        if scores[OBSTACLE] < 0.0:
            return
    for critic, layer in ((PATH, TO_PLAN), (GOAL, TO_END)):
        if scales[critic] != 0.0:
            cells = grids[layer, row, column]
            scores[critic] = cells
            if cells >= blocked:
                scores[critic] = BLOCKED if cells == blocked else UNREACHABLE
                return
    row = math.floor((point[1] + nose_m * math.sin(point[2])) * per_m)
    column = math.floor((point[0] + nose_m * math.cos(point[2])) * per_m)
    # The nose may look into obstacles: it costs, but does not reject.
    for critic, layer in ((GOAL_FRONT, TO_FRONT), (ALIGNMENT, TO_PLAN)):
        if scales[critic] != 0.0:
            if not (0 <= row < rows and 0 <= column < columns):
                scores[critic] = OFF_MAP
                return
            scores[critic] = grids[layer, row, column]


@njit(cache=True)
def _total(scores: np.ndarray, scales: np.ndarray) -> float:
    total = 0.0
    for critic in range(CRITICS):
        if scores[critic] < 0.0:
            return scores[critic]
        total += scales[critic] * scores[critic]
    return total
