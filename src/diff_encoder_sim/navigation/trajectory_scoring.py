"""Costs of standing on a costmap and of driving a trajectory over it: kernels of critics.py.

`score_samples` searches best first. No point of a trajectory costs less than zero, so the cost of its last point is
a lower bound, and most samples need no further scoring. All kernels share this file because numba's disk cache does
not notice changes in other files. Those with a Scene are inlined: calls with it made a DWA cycle 2 to 9 % longer.
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
    NO_TRAJECTORY,
    OBSTACLE,
    OFF_MAP,
    OSCILLATES,
    OSCILLATION,
    PATH,
    TWIRLING,
    UNREACHABLE,
)
from diff_encoder_sim.navigation.footprint import IN_OBSTACLE, IN_UNKNOWN
from diff_encoder_sim.navigation.footprint import OFF_MAP as FOOTPRINT_OFF_MAP
from diff_encoder_sim.navigation.plan_distances import TO_END, TO_FRONT, TO_PLAN


class Scene(NamedTuple):
    """What trajectories are scored against."""

    costs: np.ndarray  # (rows, columns) uint8 costmap
    per_m: float  # cells in a metre
    vertices_m: np.ndarray  # (n, 2) footprint in base_link
    grids: np.ndarray  # (3, rows, columns) int32, of fill_distance_grids
    nose_m: float  # from the robot's centre to its nose
    scales: np.ndarray  # (7,) weights of the critics, none below zero


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
    """Return whether the robot can stand at every point (n, 3) of a trajectory in the grid's own frame."""
    rows, columns = costs.shape
    for index in range(len(points)):
        row, column = math.floor(points[index, 1] * per_m), math.floor(points[index, 0] * per_m)
        if not (0 <= row < rows and 0 <= column < columns):
            return False
        if _standing_cost(costs, per_m, vertices_m, points[index], row, column) < 0.0:
            return False
    return True


@compiled
def _standing_cost(
    costs: np.ndarray, per_m: float, vertices_m: np.ndarray, point: np.ndarray, row: int, column: int
) -> float:
    """Return the highest cost under the outline at x, y, yaw and in the centre's cell, or COLLIDES."""
    cost = footprint_cost(costs, per_m, vertices_m, point[0], point[1], math.cos(point[2]), math.sin(point[2]))
    return COLLIDES if cost < 0.0 else max(cost, float(costs[row, column]))


@compiled
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
    scores: np.ndarray,
    totals: np.ndarray,
) -> int:
    """Return the index of the cheapest sample, the first of equals, -1 for none; fill `scores` and `totals`.

    The first six arguments are those of Scene. Samples (n, 2) are linear [m/s] and angular [rad/s], their
    trajectories the first `steps` (n,) of `points` (n, most, 3) in the grid's own frame, `allowed` (4,) is
    OscillationMemory's. Scores (n, 7) are the unweighted costs by critic, totals (n,) their weighted sums; samples
    that cannot win have those of their last points alone.
    """
    scene = Scene(costs, per_m, vertices_m, grids, nose_m, scales)
    bounds = np.full(len(samples), math.inf)
    for index in range(len(samples)):
        _score_end(scene, samples[index], points[index, : steps[index]], allowed, scores[index])
        totals[index] = _total(scores[index], scales) if steps[index] > 0 else NO_TRAJECTORY
        if totals[index] >= 0.0:
            bounds[index] = totals[index]
    best, least = -1, math.inf
    for _ in range(len(samples)):
        index = int(np.argmin(bounds))
        if bounds[index] == math.inf or bounds[index] > least:
            break
        bounds[index] = math.inf
        total = _score_rest(scene, sums_obstacle, points[index, : steps[index]], least, scores[index])
        totals[index] = total
        if 0.0 <= total < least or (total == least and index < best):
            best, least = index, total
    return best


@compiled(inline='always')
def _score_end(scene: Scene, sample: np.ndarray, points: np.ndarray, allowed: np.ndarray, scores: np.ndarray) -> None:
    """Fill `scores` (7,) with the costs of a sample and of its last point."""
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
        _score_point(scene, points[-1], scores)


@compiled(inline='always')
def _score_rest(scene: Scene, sums_obstacle: bool, points: np.ndarray, most: float, scores: np.ndarray) -> float:
    """Enter all points but the last into `scores` and return the weighted sum.

    From the end backwards, as obstacles are ahead, and no further than to a sum above `most`.
    """
    total = _total(scores, scene.scales)
    here = np.zeros(CRITICS)
    for index in range(len(points) - 2, -1, -1):
        if total < 0.0 or total > most:
            break
        _score_point(scene, points[index], here)
        scores[OBSTACLE] = scores[OBSTACLE] + here[OBSTACLE] if sums_obstacle else max(scores[OBSTACLE], here[OBSTACLE])
        total = _total(here, scene.scales)
        if total >= 0.0:
            total = _total(scores, scene.scales)
    return total


@compiled(inline='always')
def _score_point(scene: Scene, point: np.ndarray, scores: np.ndarray) -> None:
    """Fill `scores` (7,) with the costs of one place, up to the first that is below zero."""
    rows, columns = scene.costs.shape
    row, column = math.floor(point[1] * scene.per_m), math.floor(point[0] * scene.per_m)
    if not (0 <= row < rows and 0 <= column < columns):
        scores[OBSTACLE] = CENTRE_OFF_MAP
        return
    if scene.scales[OBSTACLE] != 0.0:
        scores[OBSTACLE] = _standing_cost(scene.costs, scene.per_m, scene.vertices_m, point, row, column)
        if scores[OBSTACLE] < 0.0:
            return
    blocked = rows * columns
    for critic, layer in ((PATH, TO_PLAN), (GOAL, TO_END)):
        if scene.scales[critic] != 0.0:
            cells = scene.grids[layer, row, column]
            scores[critic] = cells
            if cells >= blocked:
                scores[critic] = BLOCKED if cells == blocked else UNREACHABLE
                return
    row = math.floor((point[1] + scene.nose_m * math.sin(point[2])) * scene.per_m)
    column = math.floor((point[0] + scene.nose_m * math.cos(point[2])) * scene.per_m)
    # The nose may look into obstacles: that has a cost, but does not reject.
    for critic, layer in ((GOAL_FRONT, TO_FRONT), (ALIGNMENT, TO_PLAN)):
        if scene.scales[critic] != 0.0:
            if not (0 <= row < rows and 0 <= column < columns):
                scores[critic] = OFF_MAP
                return
            scores[critic] = scene.grids[layer, row, column]


@compiled
def _total(scores: np.ndarray, scales: np.ndarray) -> float:
    """Return the weighted sum of costs (7,), or the first that is below zero."""
    total = 0.0
    for critic in range(CRITICS):
        if scores[critic] < 0.0:
            return float(scores[critic])
        total += scales[critic] * scores[critic]
    return total
