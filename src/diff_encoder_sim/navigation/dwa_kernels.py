"""Kernels of the dynamic window approach: distances, costs of trajectories, and the search for the cheapest one.

Fox, Burgard and Thrun 1997, section III-B, as upstream divides it into critics. Each critic gives a trajectory a
cost; the weighted sum decides, and a cost below zero rejects the trajectory:

======  ===========  =====================================================  ==========================================
column  critic       cost                                                   below zero
======  ===========  =====================================================  ==========================================
0       oscillation  0                                                      -5: reverses a direction that is locked
1       obstacle     highest cost under outline and centre                  -6 in collision, -7 off the map
2       goal front   cells from the nose to the point beyond the goal       -4 off the map
3       alignment    cells from the nose to the plan                        -4 off the map
4       path         cells from the centre to the plan                      -2 unreachable, -3 blocked, -4 off the map
5       goal         cells from the centre to the plan's end in the window  as path
6       twirling     turning speed [rad/s]
======  ===========  =====================================================  ==========================================

Distances are those of the trajectory's last point, but every point must be accepted.

The search is best first, in one call of a kernel in a control period. A trajectory costs at least what its last point
does by its distances from the plan, and its first one, which is that of all, by its obstacles. A closed form gives the
cells of last points: all except a few samples need no trajectory.

Kernels take what they need of a Scene one by one: to take an array out of a tuple counts a reference to it, which costs
as much as to score a point. They are in one file, because numba's cache does not notice changes in another one.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap_layers import INSCRIBED, LETHAL, NO_INFORMATION
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.footprint import IN_OBSTACLE, IN_UNKNOWN
from diff_encoder_sim.navigation.footprint import OFF_MAP as FOOTPRINT_OFF_MAP

OSCILLATION, OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(7)
CRITICS = 7

NO_TRAJECTORY, UNREACHABLE, BLOCKED, OFF_MAP = -1.0, -2.0, -3.0, -4.0
OSCILLATES, COLLIDES, CENTRE_OFF_MAP = -5.0, -6.0, -7.0


# The waves: from the plan, from its end, from the nose's goal beyond it.
TO_PLAN, TO_END, TO_FRONT = range(3)


class Waves(NamedTuple):
    """Three wavefronts over one costmap.

    `cells` holds distances inside a fence, which spares the waves the check for the grid's edge: cells that block the
    robot's centre get the number of cells, those not reached (yet) one more, both farther than any path, and those
    that would block two more.
    """

    cells: np.ndarray  # (3, (rows + 2) * (columns + 2)) int32
    queues: np.ndarray  # (3, rows * columns) int32, places in `cells` in the order in which they are reached
    counts: np.ndarray  # (3, 2) int64: places that are taken from the queue, and put into it


def make_waves(shape: Tuple[int, int]) -> Waves:
    """Make waves for costmaps of (rows, columns)."""
    rows, columns = shape
    size = rows * columns
    cells = np.full((3, (rows + 2) * (columns + 2)), size, np.int32)
    return Waves(cells, np.empty((3, size), np.int32), np.zeros((3, 2), np.int64))


@compiled
def begin_waves(
    costs: np.ndarray, per_m: float, origin: Pose2D, plan: np.ndarray, pose: Pose2D, nose_m: float, waves: Waves
) -> bool:
    """Begin waves at the plan, at its end, and at the nose's goal beyond it.

    The plan (n, 3), n > 0, is in the frame of the grid's origin; `pose` is the robot in the grid's own frame, its nose
    `nose_m` ahead of its centre. Waves from an end begin at the last point before the plan leaves the
    grid. Returns False if no point is on known cells.
    """
    _forget(costs, waves)
    cos_yaw, sin_yaw = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    x_before_m, y_before_m, place, front_place = 0.0, 0.0, -1, -1
    for index in range(len(plan)):
        x_m, y_m = plan[index, 0] - origin.x_m, plan[index, 1] - origin.y_m
        x_m, y_m = x_m * cos_yaw + y_m * sin_yaw, y_m * cos_yaw - x_m * sin_yaw
        if index == len(plan) - 1:
            # The nose's goal is beyond the goal as seen from the robot, not along the goal's heading, which would
            # swing around when the robot must turn at the end.
            bearing_rad = math.atan2(y_m - pose.y_m, x_m - pose.x_m)
            x_front_m, y_front_m = x_m + nose_m * math.cos(bearing_rad), y_m + nose_m * math.sin(bearing_rad)
            if index == 0:
                x_before_m, y_before_m = x_front_m, y_front_m
            front_place, _ = _walk(costs, per_m, x_before_m, y_before_m, x_front_m, y_front_m, place, False, waves)
        if index == 0:
            x_before_m, y_before_m = x_m, y_m
        place, has_left = _walk(costs, per_m, x_before_m, y_before_m, x_m, y_m, place, True, waves)
        if has_left:
            if index < len(plan) - 1:
                front_place = place
            break
        x_before_m, y_before_m = x_m, y_m
    _begin_at(TO_END, place, waves)
    _begin_at(TO_FRONT, front_place, waves)
    return place >= 0 and front_place >= 0


@compiled
def _forget(costs: np.ndarray, waves: Waves) -> None:
    """Make all cells not reached."""
    rows, columns = costs.shape
    unreached = np.int32(rows * columns + 1)
    cells, counts = waves.cells, waves.counts
    for layer in range(len(cells)):
        counts[layer, 0] = counts[layer, 1] = 0
        for row in range(rows):
            first = (row + 1) * (columns + 2) + 1
            for column in range(columns):
                cells[layer, first + column] = unreached + np.int32(costs[row, column] >= INSCRIBED)


@compiled
def _walk(
    costs: np.ndarray,
    per_m: float,
    x_m: float,
    y_m: float,
    to_x_m: float,
    to_y_m: float,
    place: int,
    marks: bool,
    waves: Waves,
) -> Tuple[int, bool]:
    """Go along a line that follows a `place`, -1 for none yet; if it `marks`, the plan's wave begins at its cells.

    Returns the last place on known cells, and whether the line has left them.
    """
    rows, columns = costs.shape
    x_step, y_step = to_x_m - x_m, to_y_m - y_m
    # Points farther apart than a cell leave no gaps.
    steps = max(1, math.ceil(math.sqrt(x_step * x_step + y_step * y_step) * per_m))
    for step in range(1, steps + 1):
        row = math.floor((y_m + y_step * step / steps) * per_m)
        column = math.floor((x_m + x_step * step / steps) * per_m)
        if 0 <= row < rows and 0 <= column < columns and costs[row, column] != NO_INFORMATION:
            place = (row + 1) * (columns + 2) + column + 1
            if marks and waves.cells[TO_PLAN, place] != 0:
                _begin_at(TO_PLAN, place, waves)
        elif place >= 0:
            return place, True
    return place, False


@compiled
def _begin_at(layer: int, place: int, waves: Waves) -> None:
    """Have a wave begin at a place, too; -1 is none."""
    if place >= 0:
        waves.cells[layer, place] = 0
        waves.queues[layer, waves.counts[layer, 1]] = place
        waves.counts[layer, 1] += 1


@compiled
def distance_to(
    cells: np.ndarray,
    queues: np.ndarray,
    counts: np.ndarray,
    layer: int,
    size: int,
    columns: int,
    row: int,
    column: int,
) -> int:
    """Return the distance [cells] of a cell on the grid of `size` cells, once the wave has come to it.

    The first three arguments are those of Waves.
    """
    place = (row + 1) * (columns + 2) + column + 1
    if cells[layer, place] > size:
        spread(cells, queues, counts, layer, size, columns + 2, place)
    return int(min(cells[layer, place], size + 1))


@compiled
def spread(
    cells: np.ndarray, queues: np.ndarray, counts: np.ndarray, layer: int, size: int, wide: int, place: int
) -> None:
    """Run a wave over a fenced grid, `wide` cells a row, until it comes to a place; -1 is nowhere, so to its end."""
    unreached = size + 1
    taken, filled = counts[layer, 0], counts[layer, 1]
    while taken < filled and (place < 0 or cells[layer, place] >= unreached):
        cell = queues[layer, taken]
        taken += 1
        farther = cells[layer, cell] + 1
        for step in (-wide, wide, -1, 1):
            to_cell = cell + step
            if cells[layer, to_cell] == unreached:
                cells[layer, to_cell] = farther
                queues[layer, filled] = to_cell
                filled += 1
            elif cells[layer, to_cell] > unreached:
                cells[layer, to_cell] = size  # blocked
    counts[layer, 0], counts[layer, 1] = taken, filled


@compiled
def whole_grid(waves: Waves, layer: int, rows: int, columns: int) -> np.ndarray:
    """Return the distances [cells] of all cells, (rows, columns) int32."""
    size = rows * columns
    spread(waves.cells, waves.queues, waves.counts, layer, size, columns + 2, -1)
    fenced = waves.cells[layer].reshape((rows + 2, columns + 2))
    grid: np.ndarray = np.minimum(fenced[1:-1, 1:-1], np.int32(size + 1))
    return grid


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


class WindowParams(NamedTuple):
    """Limits of the dynamic window, and how it is sampled."""

    min_linear_mps: float
    max_linear_mps: float
    max_angular_radps: float
    linear_mps2: float
    angular_radps2: float
    horizon_s: float  # time in which a velocity must be reached
    spares_goal: bool  # no velocity passes the goal within the horizon
    linear_count: int
    angular_count: int


def window_params(params: DwaParams, sim_period_s: float) -> WindowParams:
    """Return the limits: with use_dwa for one control period; without it for sim_time."""
    return WindowParams(
        params.min_vel_x,
        params.max_vel_x,
        params.max_vel_theta,
        params.acc_lim_x,
        params.acc_lim_theta,
        sim_period_s if params.use_dwa else params.sim_time,
        not params.use_dwa,
        params.vx_samples,
        params.vth_samples,
    )


@compiled
def dynamic_window(
    params: WindowParams, linear_mps: float, angular_radps: float, goal_distance_m: float
) -> Tuple[float, float, float, float]:
    """Return the lowest and highest linear [m/s] and angular [rad/s] velocities that the limits allow around a twist.

    A quantised twist can be above the limits (at 40 PPR the second step is 0.63 m/s): then the window is the limit
    alone, where upstream would sample from the limit up to what it takes for reachable.
    """
    lowest_mps, highest_mps = params.min_linear_mps, params.max_linear_mps
    if params.spares_goal:
        highest_mps = max(min(highest_mps, goal_distance_m / params.horizon_s), lowest_mps)
    linear_change, angular_change = params.linear_mps2 * params.horizon_s, params.angular_radps2 * params.horizon_s
    return (
        min(max(linear_mps - linear_change, lowest_mps), highest_mps),
        min(max(linear_mps + linear_change, lowest_mps), highest_mps),
        min(max(angular_radps - angular_change, -params.max_angular_radps), params.max_angular_radps),
        min(max(angular_radps + angular_change, -params.max_angular_radps), params.max_angular_radps),
    )


@compiled
def samples_between(low: float, high: float, count: int) -> np.ndarray:
    """Return evenly spaced samples with both ends, and 0 where it lies between two of them.

    As upstream's VelocityIterator: at least two samples, unless the ends are equal.
    """
    if low == high:
        return np.array([low])
    count = max(2, count)
    step = (high - low) / (count - 1)
    samples, filled = np.empty(count + 1), 0
    for index in range(count - 1):
        value = low + index * step
        samples[filled] = value
        filled += 1
        if value < 0.0 < value + step:
            samples[filled] = 0.0
            filled += 1
    samples[filled] = high
    return samples[: filled + 1]


@compiled
def velocity_samples(
    params: WindowParams, linear_mps: float, angular_radps: float, goal_distance_m: float
) -> np.ndarray:
    """Return samples (n, 2) linear [m/s], angular [rad/s] of the window around a twist, the angular ones innermost."""
    low_mps, high_mps, low_radps, high_radps = dynamic_window(params, linear_mps, angular_radps, goal_distance_m)
    linear = samples_between(low_mps, high_mps, params.linear_count)
    angular = samples_between(low_radps, high_radps, params.angular_count)
    samples = np.empty((len(linear) * len(angular), 2))
    for index in range(len(samples)):
        samples[index, 0] = linear[index // len(angular)]
        samples[index, 1] = angular[index % len(angular)]
    return samples


class RolloutParams(NamedTuple):
    """How trajectories are simulated, and which samples have one."""

    sim_time_s: float
    granularity_m: float
    angular_granularity_rad: float
    accelerates: bool  # from the robot's velocity to the sample's; else the sample's at once
    linear_mps2: float
    angular_radps2: float
    min_trans_mps: float
    max_trans_mps: float
    min_theta_radps: float


def rollout_params(params: DwaParams) -> RolloutParams:
    """Return the parameters of the DWA's trajectories."""
    return RolloutParams(
        params.sim_time,
        params.sim_granularity,
        params.angular_sim_granularity,
        not params.use_dwa,
        params.acc_lim_x,
        params.acc_lim_theta,
        params.min_vel_trans,
        params.max_vel_trans,
        params.min_vel_theta,
    )


@compiled
def step_count(params: RolloutParams, linear_mps: float, angular_radps: float) -> int:
    """Return the number of points of a trajectory, so that none are farther apart than the granularities."""
    return math.ceil(
        max(
            abs(linear_mps) * params.sim_time_s / params.granularity_m,
            abs(angular_radps) * params.sim_time_s / params.angular_granularity_rad,
        )
    )


@compiled
def sample_step_count(params: RolloutParams, linear_mps: float, angular_radps: float) -> int:
    """Return the number of points of a sample's trajectory, 0 where it is too slow or too fast to have one."""
    is_too_slow = abs(linear_mps) + 1e-4 < params.min_trans_mps and abs(angular_radps) + 1e-4 < params.min_theta_radps
    if is_too_slow or abs(linear_mps) - 1e-4 > params.max_trans_mps:
        return 0
    return step_count(params, linear_mps, angular_radps)


@compiled
def approach(value: float, target: float, largest_step: float) -> float:
    """Move `value` towards `target` by no more than a step."""
    if value < target:
        return min(target, value + largest_step)
    return max(target, value - largest_step)


@compiled
def roll_out(
    params: RolloutParams,
    pose: Pose2D,
    twist: Tuple[float, float],
    sample: Tuple[float, float],
    steps: int,
    points: np.ndarray,
) -> None:
    """Fill the first `steps` of `points` (n, 5) from the start on, without the end of the last step.

    Points are x, y, yaw, cos(yaw), sin(yaw).
    Twist and sample are in m/s and rad/s.
    """
    interval_s = params.sim_time_s / steps
    x_m, y_m, yaw_rad = pose
    linear_mps, angular_radps = twist if params.accelerates else sample
    for step in range(steps):
        cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
        points[step, 0], points[step, 1], points[step, 2] = x_m, y_m, yaw_rad
        points[step, 3], points[step, 4] = cos_yaw, sin_yaw
        if params.accelerates:
            linear_mps = approach(linear_mps, sample[0], params.linear_mps2 * interval_s)
            angular_radps = approach(angular_radps, sample[1], params.angular_radps2 * interval_s)
        x_m += linear_mps * cos_yaw * interval_s
        y_m += linear_mps * sin_yaw * interval_s
        yaw_rad += angular_radps * interval_s


@compiled
def last_point(
    params: RolloutParams, pose: Pose2D, linear_mps: float, angular_radps: float, steps: int
) -> Tuple[float, float, float]:
    """Return the last point x, y, yaw of `roll_out` without acceleration, equal but for rounding.

    Its steps are the sides of a regular polygon.
    """
    interval_s = params.sim_time_s / steps
    moves, half_turn_rad = steps - 1, 0.5 * angular_radps * interval_s
    chord_m = linear_mps * interval_s
    chord_m *= math.sin(moves * half_turn_rad) / math.sin(half_turn_rad) if abs(half_turn_rad) > 1e-12 else moves
    chord_yaw_rad = pose.yaw_rad + (moves - 1) * half_turn_rad
    return (
        pose.x_m + chord_m * math.cos(chord_yaw_rad),
        pose.y_m + chord_m * math.sin(chord_yaw_rad),
        pose.yaw_rad + 2.0 * moves * half_turn_rad,
    )


class ScoringTask(NamedTuple):
    """What one control period chooses from, and by what."""

    window: WindowParams
    rollout: RolloutParams
    scene: Scene
    pose_in_grid: Pose2D  # of the robot
    twist: Tuple[float, float]  # its linear [m/s] and angular [rad/s] velocity
    goal_distance_m: float  # from the robot to the plan's end in sight
    allowed: Tuple[bool, bool, bool, bool]  # forward, backward, left and right, of OscillationMemory


@compiled
def find_cheapest(
    task: ScoringTask, origin: Pose2D, plan: np.ndarray, base_pose: Pose2D
) -> Tuple[float, float, float, np.ndarray]:
    """Begin the waves at a plan (n, 3), n > 0, and return the command of the cheapest sample, the first of equals.

    Plan and base pose are in the frame of the grid's origin.

    Returns:
        Linear [m/s] and angular [rad/s] velocity, the sample's cost and its trajectory (n, 5) as of `roll_out`; the
        cost is inf if all samples are rejected, or the plan is off the grid.
    """
    scene = task.scene
    if not begin_waves(scene.costs, scene.per_m, origin, plan, task.pose_in_grid, scene.nose_m, scene.waves):
        return 0.0, 0.0, math.inf, np.empty((0, 5))
    samples = velocity_samples(task.window, task.twist[0], task.twist[1], task.goal_distance_m)
    best, cost = _search(task, samples)
    if best < 0:
        return 0.0, 0.0, math.inf, np.empty((0, 5))
    sample = (samples[best, 0], samples[best, 1])
    steps = sample_step_count(task.rollout, sample[0], sample[1])
    points = np.empty((steps, 5))
    roll_out(task.rollout, base_pose, task.twist, sample, steps, points)
    linear_mps, angular_radps = _command(task.rollout, task.twist, sample, steps)
    return linear_mps, angular_radps, cost, points


@compiled
def _command(
    params: RolloutParams, twist: Tuple[float, float], sample: Tuple[float, float], steps: int
) -> Tuple[float, float]:
    """Return the velocities that a trajectory begins with: where it accelerates, what its first step reaches."""
    if not params.accelerates:
        return sample
    interval_s = params.sim_time_s / steps
    return (
        approach(twist[0], sample[0], params.linear_mps2 * interval_s),
        approach(twist[1], sample[1], params.angular_radps2 * interval_s),
    )


@compiled
def _search(task: ScoringTask, samples: np.ndarray) -> Tuple[int, float]:
    """Return the index of the cheapest of samples (n, 2) and its cost; -1 and inf if all are rejected."""
    least, steps = _least_costs(task, samples)
    points, scores = np.empty((steps.max(), 5)), np.empty(CRITICS)
    best, cost = -1, math.inf
    while True:
        index = int(np.argmin(least))
        if least[index] == math.inf or least[index] > cost or (least[index] == cost and index > best):
            return best, cost
        least[index] = math.inf
        sample = (samples[index, 0], samples[index, 1])
        roll_out(task.rollout, task.pose_in_grid, task.twist, sample, steps[index], points)
        total = _score(task, sample, points, steps[index], cost, scores)
        if 0.0 <= total < cost or (total == cost and index < best):
            best, cost = index, total


@compiled
def _score(
    task: ScoringTask, sample: Tuple[float, float], points: np.ndarray, steps: int, most: float, scores: np.ndarray
) -> float:
    """Return the cost of a trajectory of so many points (n, 5); see `score_trajectory`, which fills the scores (7,)."""
    costs, per_m, vertices_m, waves, nose_m, scales, sums_obstacle = task.scene
    cells, queues, counts = waves
    return score_trajectory(
        costs,
        per_m,
        vertices_m,
        cells,
        queues,
        counts,
        nose_m,
        scales,
        sums_obstacle,
        sample[1],
        points,
        steps,
        most,
        scores,
    )


@compiled
def _least_costs(task: ScoringTask, samples: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return what samples (n, 2) cost at least (n,), inf where that is known to reject them, and their steps (n,)."""
    costs, per_m, vertices_m, waves, nose_m, scales, _ = task.scene
    cells, queues, counts = waves
    rollout, pose = task.rollout, task.pose_in_grid
    least, steps, scores = np.full(len(samples), math.inf), np.zeros(len(samples), np.int64), np.empty(CRITICS)
    x_m, y_m, cos_yaw, sin_yaw = pose.x_m, pose.y_m, math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    obstacle = standing_cost(costs, per_m, vertices_m, scales, x_m, y_m, cos_yaw, sin_yaw)
    if obstacle < 0.0:
        return least, steps
    for index in range(len(samples)):
        linear_mps, angular_radps = samples[index, 0], samples[index, 1]
        count = sample_step_count(rollout, linear_mps, angular_radps)
        if count == 0 or is_bound(linear_mps, angular_radps, task.allowed):
            continue
        steps[index], least[index] = count, 0.0
        if not rollout.accelerates:
            x_m, y_m, yaw_rad = last_point(rollout, pose, linear_mps, angular_radps, count)
            least[index] = least_cost(
                costs, per_m, cells, queues, counts, nose_m, scales, angular_radps, obstacle, x_m, y_m, yaw_rad, scores
            )
    return least, steps


@compiled
def is_bound(linear_mps: float, angular_radps: float, allowed: Tuple[bool, bool, bool, bool]) -> bool:
    """Return whether a sample goes in a direction that is not allowed now."""
    return (
        (linear_mps > 0 and not allowed[0])
        or (linear_mps < 0 and not allowed[1])
        or (angular_radps > 0 and not allowed[2])
        or (angular_radps < 0 and not allowed[3])
    )


@compiled
def score_all(task: ScoringTask) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Score each sample to its beginning, for displays; the waves must have begun.

    Returns:
        Samples (n, 2), their numbers of points (n,) and these (n, most, 5), their scores by critic (n, 7) and
        weighted sums (n,), below zero where they are rejected; scores are complete where they are not.
    """
    samples = velocity_samples(task.window, task.twist[0], task.twist[1], task.goal_distance_m)
    steps = np.array([sample_step_count(task.rollout, sample[0], sample[1]) for sample in samples])
    points = np.empty((len(samples), steps.max(), 5))
    scores, totals = np.zeros((len(samples), CRITICS)), np.full(len(samples), NO_TRAJECTORY)
    for index in range(len(samples)):
        sample, count = (samples[index, 0], samples[index, 1]), steps[index]
        if count == 0:
            continue
        roll_out(task.rollout, task.pose_in_grid, task.twist, sample, count, points[index])
        if is_bound(sample[0], sample[1], task.allowed):
            scores[index, OSCILLATION] = totals[index] = OSCILLATES
            continue
        totals[index] = _score(task, sample, points[index], count, math.inf, scores[index])
    return samples, steps, points, scores, totals
