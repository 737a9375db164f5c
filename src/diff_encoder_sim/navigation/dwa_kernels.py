"""Kernels of the dynamic window approach: distances, costs of trajectories, and the search for the cheapest one.

Fox, Burgard and Thrun 1997, section III-B, as upstream divides it into critics. A trajectory's cost is the weighted sum
of its critics' costs:

===========  =====================================================  ===========================================
critic       cost                                                   rejects a trajectory
===========  =====================================================  ===========================================
oscillation  0                                                      in a direction that is locked
obstacle     highest cost under outline and centre                  in collision, or off the map
goal front   cells from the nose to the point beyond the goal       whose nose leaves the map
alignment    cells from the nose to the plan                        whose nose leaves the map
path         cells from the centre to the plan                      blocked, or cut off from the plan
goal         cells from the centre to the plan's end in the window  blocked, or cut off from the end
twirling     turning speed [rad/s]
===========  =====================================================  ===========================================

Distances are those of the trajectory's last point, but every point must be accepted. The search is best first: a closed
form gives the last points, and with the obstacles at the first point, which all share, a lower bound of the cost.

Inner kernels take arrays one by one, and the innermost are inlined: taking an array out of a tuple counts a reference.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap_params import (
    IN_OBSTACLE,
    IN_UNKNOWN,
    INSCRIBED,
    LETHAL,
    NO_INFORMATION,
    OFF_MAP,
)

# Critics with a weight, in the order in which their costs are added.
OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(6)
REJECTED = -1.0

# The waves: from the plan, from its end, from the nose's goal beyond it.
TO_PLAN, TO_END, TO_FRONT = range(3)

ROUNDING_CELLS = 1e-6  # rounding does not change the cell of a point at this distance from its edges

Twist = Tuple[float, float]  # linear [m/s], angular [rad/s]
Place = Tuple[float, float, float, float]  # in the grid's own frame: x, y [m], cosine and sine of the yaw

# Numbers of DwaParams, and the time in which a sampled velocity must be reached: a control period, or sim_time.
DwaLimits = namedtuple(
    'DwaLimits',
    'min_vel_x max_vel_x max_vel_theta acc_lim_x acc_lim_theta min_vel_trans max_vel_trans min_vel_theta '
    'sim_time sim_granularity angular_sim_granularity vx_samples vth_samples use_dwa sum_scores '
    'forward_point_distance horizon_s',
)


class ScoringTask(NamedTuple):
    """Input of one control period.

    `cells` holds distances inside a fence, which spares a check for the grid's edge: the number of all cells in blocked
    cells, one more in those not reached (yet), and two more in those that would block.
    """

    limits: DwaLimits
    costs: np.ndarray  # (rows, columns) uint8 costmap
    per_m: float  # cells in a metre
    vertices_m: np.ndarray  # (n, 2) footprint in base_link
    cells: np.ndarray  # (3, (rows + 2) * (columns + 2)) int32
    queues: np.ndarray  # (3, rows * columns) int32, places in `cells` in the order in which the waves reach them
    counts: np.ndarray  # (3, 2) int64: places that are taken from the queue, and put into it
    scales: np.ndarray  # (6,) weights of the critics, none below zero
    pose_in_grid: Pose2D  # of the robot
    twist: Twist  # of the robot
    goal_distance_m: float  # from the robot to the plan's end in sight
    allowed: Tuple[bool, bool, bool, bool]  # forward, backward, left and right, of OscillationMemory


def make_waves(rows: int, columns: int) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return cells, queues and counts of ScoringTask for costmaps of this shape."""
    size = rows * columns
    cells = np.full((3, (rows + 2) * (columns + 2)), size, np.int32)
    return cells, np.empty((3, size), np.int32), np.zeros((3, 2), np.int64)


@compiled
def begin_waves(task: ScoringTask, origin: Pose2D, plan: Array) -> bool:
    """Begin waves at the plan (n, 3), n > 0, its last known cell, and the nose's goal beyond; False if off the grid.

    The plan is in the frame of the grid's origin.
    """
    costs, per_m, cells, queues, counts = task.costs, task.per_m, task.cells, task.queues, task.counts
    rows, columns = costs.shape
    unreached = np.int32(rows * columns + 1)
    counts[:] = 0
    for layer in range(len(cells)):
        for row in range(rows):
            first = (row + 1) * (columns + 2) + 1
            for column in range(columns):
                cells[layer, first + column] = unreached + np.int32(costs[row, column] >= INSCRIBED)
    cos_yaw, sin_yaw, nose_m = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad), task.limits.forward_point_distance
    ahead_m, left_m = plan[:, 0] - origin.x_m, plan[:, 1] - origin.y_m
    xs_m, ys_m = ahead_m * cos_yaw + left_m * sin_yaw, left_m * cos_yaw - ahead_m * sin_yaw
    place = front_place = -1
    for index in range(len(plan)):
        before, x_m, y_m = max(0, index - 1), xs_m[index], ys_m[index]
        if index == len(plan) - 1:
            # As seen from the robot: the goal's heading would swing it around when the robot must turn at the end.
            bearing_rad = math.atan2(y_m - task.pose_in_grid.y_m, x_m - task.pose_in_grid.x_m)
            nose = x_m + nose_m * math.cos(bearing_rad), y_m + nose_m * math.sin(bearing_rad)
            line = xs_m[before], ys_m[before], nose[0], nose[1]
            front_place, _ = _walk(costs, per_m, line, place, False, cells, queues, counts)
        line = xs_m[before], ys_m[before], x_m, y_m
        place, has_left = _walk(costs, per_m, line, place, True, cells, queues, counts)
        if has_left:
            front_place = place if index < len(plan) - 1 else front_place
            break
    if place < 0 or front_place < 0:
        return False
    _begin_at(TO_END, place, cells, queues, counts)
    _begin_at(TO_FRONT, front_place, cells, queues, counts)
    return True


@compiled
def _walk(
    costs: Array, per_m: float, line: Place, place: int, marks: bool, cells: Array, queues: Array, counts: Array
) -> Tuple[int, bool]:
    """Follow a line (x, y, to x, to y) after a `place` (-1: none yet); if it `marks`, the plan's wave begins on it.

    Returns the last place on known cells, and whether the line has left them.
    """
    rows, columns = costs.shape
    x_m, y_m, x_step, y_step = line[0], line[1], line[2] - line[0], line[3] - line[1]
    # Points farther apart than a cell leave no gaps.
    steps = max(1, math.ceil(math.sqrt(x_step * x_step + y_step * y_step) * per_m))
    for step in range(1, steps + 1):
        row = math.floor((y_m + y_step * step / steps) * per_m)
        column = math.floor((x_m + x_step * step / steps) * per_m)
        if 0 <= row < rows and 0 <= column < columns and costs[row, column] != NO_INFORMATION:
            place = (row + 1) * (columns + 2) + column + 1
            if marks and cells[TO_PLAN, place] != 0:
                _begin_at(TO_PLAN, place, cells, queues, counts)
        elif place >= 0:
            return place, True
    return place, False


@compiled
def _begin_at(layer: int, place: int, cells: Array, queues: Array, counts: Array) -> None:
    cells[layer, place] = 0
    queues[layer, counts[layer, 1]] = place
    counts[layer, 1] += 1


@compiled(inline='always')
def _distance_to(
    cells: Array, queues: Array, counts: Array, layer: int, size: int, columns: int, row: int, column: int
) -> int:
    """Return the distance [cells] of a cell on the grid of `size` cells after the wave has reached it."""
    place = (row + 1) * (columns + 2) + column + 1
    if cells[layer, place] > size:
        _spread(cells, queues, counts, layer, size, columns + 2, place)
    return int(min(cells[layer, place], size + 1))


@compiled
def _spread(cells: Array, queues: Array, counts: Array, layer: int, size: int, wide: int, place: int) -> None:
    """Run a wave over a fenced grid, `wide` cells a row, until it reaches a place; -1: to its end."""
    distances, queue, unreached = cells[layer], queues[layer], size + 1
    taken, filled = counts[layer, 0], counts[layer, 1]
    while taken < filled and (place < 0 or distances[place] >= unreached):
        cell = queue[taken]
        taken += 1
        farther = distances[cell] + 1
        for step in (-wide, wide, -1, 1):
            to_cell = np.uintp(cell + step)  # spares the check for negative indices
            distance = distances[to_cell]
            if distance == unreached:
                distances[to_cell] = farther
                queue[np.uintp(filled)] = to_cell
                filled += 1
            elif distance > unreached:
                distances[to_cell] = size  # blocked
    counts[layer, 0], counts[layer, 1] = taken, filled


@compiled
def whole_grid(task: ScoringTask, layer: int) -> np.ndarray:
    """Return the distances [cells] of all cells from the beginning of a wave, (rows, columns) int32."""
    rows, columns = task.costs.shape
    size = rows * columns
    _spread(task.cells, task.queues, task.counts, layer, size, columns + 2, -1)
    grid: np.ndarray = np.minimum(task.cells[layer].reshape((rows + 2, columns + 2))[1:-1, 1:-1], np.int32(size + 1))
    return grid


@compiled
def footprint_cost(costs: Array, per_m: float, vertices_m: Array, place: Place) -> float:
    """Return the highest cost under the outline (n, 2) of a footprint, or a reason (< 0) why it cannot stand there."""
    x_m, y_m, cos_yaw, sin_yaw = place
    highest, row, column = 0.0, 0, 0
    for index in range(-1, len(vertices_m)):
        ahead_m, left_m = vertices_m[index, 0], vertices_m[index, 1]
        to_row = math.floor((y_m + sin_yaw * ahead_m + cos_yaw * left_m) * per_m)
        to_column = math.floor((x_m + cos_yaw * ahead_m - sin_yaw * left_m) * per_m)
        if index >= 0:
            cost = _line_cost(costs, row, column, to_row, to_column)
            if cost < 0.0:
                return cost
            highest = max(highest, cost)
        row, column = to_row, to_column
    return highest


@compiled
def _line_cost(costs: Array, row: int, column: int, to_row: int, to_column: int) -> float:
    """Return the highest cost on a line of cells (Bresenham), or a reason (< 0) as `footprint_cost`."""
    rows, columns = costs.shape
    if not (0 <= row < rows and 0 <= to_row < rows and 0 <= column < columns and 0 <= to_column < columns):
        return OFF_MAP
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
def stays_clear(limits: DwaLimits, costs: Array, per_m: float, vertices_m: Array, pose: Pose2D, twist: Twist) -> bool:
    """Return whether the robot can stand at every point of a constant velocity's trajectory from a pose in the grid."""
    points = np.empty((_step_count(limits, twist), 5))
    _roll_out(limits, pose, twist, twist, points)
    for point in points:
        if footprint_cost(costs, per_m, vertices_m, (point[0], point[1], point[3], point[4])) < 0.0:
            return False
    return True


@compiled(inline='always')
def _standing_cost(costs: Array, per_m: float, vertices_m: Array, scales: Array, place: Place) -> float:
    """Return the highest cost under outline and centre, below zero if rejected; 0 on the grid without a weight."""
    rows, columns = costs.shape
    row, column = math.floor(place[1] * per_m), math.floor(place[0] * per_m)
    if not (0 <= row < rows and 0 <= column < columns):
        return REJECTED
    if scales[OBSTACLE] == 0.0:
        return 0.0
    cost = footprint_cost(costs, per_m, vertices_m, place)
    return REJECTED if cost < 0.0 else max(cost, float(costs[row, column]))


@compiled(inline='always')
def _distance_costs(
    costs: Array, per_m: float, cells: Array, queues: Array, counts: Array, scales: Array, place: Place, nose_m: float
) -> Tuple[float, float, float, float]:
    """Return the weighted costs of GOAL_FRONT to GOAL at a place on the grid; the first is REJECTED if that rejects."""
    rows, columns = costs.shape
    x_m, y_m, cos_yaw, sin_yaw = place
    size, row, column = rows * columns, math.floor(y_m * per_m), math.floor(x_m * per_m)
    path = goal = front = alignment = 0.0
    if scales[PATH] != 0.0:
        distance = _distance_to(cells, queues, counts, TO_PLAN, size, columns, row, column)
        if distance >= size:  # blocked, or not reached
            return REJECTED, 0.0, 0.0, 0.0
        path = scales[PATH] * distance
    if scales[GOAL] != 0.0:
        distance = _distance_to(cells, queues, counts, TO_END, size, columns, row, column)
        if distance >= size:
            return REJECTED, 0.0, 0.0, 0.0
        goal = scales[GOAL] * distance
    # The nose may look into obstacles: that has a cost, but does not reject.
    row, column = math.floor((y_m + nose_m * sin_yaw) * per_m), math.floor((x_m + nose_m * cos_yaw) * per_m)
    if (scales[GOAL_FRONT] != 0.0 or scales[ALIGNMENT] != 0.0) and not (0 <= row < rows and 0 <= column < columns):
        return REJECTED, 0.0, 0.0, 0.0
    if scales[GOAL_FRONT] != 0.0:
        front = scales[GOAL_FRONT] * _distance_to(cells, queues, counts, TO_FRONT, size, columns, row, column)
    if scales[ALIGNMENT] != 0.0:
        alignment = scales[ALIGNMENT] * _distance_to(cells, queues, counts, TO_PLAN, size, columns, row, column)
    return front, alignment, path, goal


@compiled
def _score(task: ScoringTask, turn_radps: float, points: Array, most: float) -> float:
    """Return the cost of a trajectory `points` (n, 5), n > 0, from the end backwards up to `most`; < 0 if rejected."""
    limits, costs, per_m, vertices_m, cells, queues, counts, scales, _, _, _, _ = task
    nose_m, twirling = limits.forward_point_distance, scales[TWIRLING] * abs(turn_radps)
    total = highest = front = alignment = path = goal = 0.0
    row_after = column_after = -2
    for index in range(len(points) - 1, -1, -1):
        place = (points[index, 0], points[index, 1], points[index, 3], points[index, 4])
        obstacle = _standing_cost(costs, per_m, vertices_m, scales, place)
        if obstacle < 0.0:
            return REJECTED
        highest = highest + obstacle if limits.sum_scores else max(highest, obstacle)
        # Waves reach each free cell next to one that they reach: few points need a look at the distances.
        row, column = math.floor(place[1] * per_m), math.floor(place[0] * per_m)
        is_accepted = (
            abs(row - row_after) <= 1
            and abs(column - column_after) <= 1
            and costs[row, column] < INSCRIBED
            and min(costs[row, column_after], costs[row_after, column]) < INSCRIBED
            and 0.0 <= (place[1] + nose_m * place[3]) * per_m < costs.shape[0]
            and 0.0 <= (place[0] + nose_m * place[2]) * per_m < costs.shape[1]
        )
        if not is_accepted:
            here = _distance_costs(costs, per_m, cells, queues, counts, scales, place, nose_m)
            if here[0] < 0.0:
                return REJECTED
            if index == len(points) - 1:
                front, alignment, path, goal = here
        row_after, column_after = row, column
        total = scales[OBSTACLE] * highest + front + alignment + path + goal + twirling
        if total > most:
            break
    return total


@compiled
def _least_costs(task: ScoringTask, samples: Array) -> Tuple[np.ndarray, np.ndarray]:
    """Return lower bounds (n,) of the costs of samples (n, 2), inf if rejected, and their steps (n,).

    By the last point of a regular polygon, of `_roll_out`; 0 if rounding may change its cell, and without use_dwa.
    """
    limits, costs, per_m, vertices_m, cells, queues, counts, scales, pose, _, _, allowed = task
    rows, columns = costs.shape
    nose_m = limits.forward_point_distance
    least, steps = np.full(len(samples), math.inf), np.zeros(len(samples), np.int64)
    cos_yaw, sin_yaw = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    obstacle = _standing_cost(costs, per_m, vertices_m, scales, (pose.x_m, pose.y_m, cos_yaw, sin_yaw))
    if obstacle < 0.0:
        return least, steps
    for index in range(len(samples)):
        linear_mps, angular_radps = samples[index, 0], samples[index, 1]
        steps[index] = sample_steps(limits, (linear_mps, angular_radps), allowed)
        if steps[index] == 0:
            continue
        moves, interval_s = steps[index] - 1, limits.sim_time / steps[index]
        half_rad = 0.5 * angular_radps * interval_s  # of a step's turn
        cos_half, sin_half = math.cos(half_rad), math.sin(half_rad)
        cos_turned, sin_turned = math.cos(moves * half_rad), math.sin(moves * half_rad)
        cos_mid, sin_mid = cos_yaw * cos_turned - sin_yaw * sin_turned, sin_yaw * cos_turned + cos_yaw * sin_turned
        chord_m = linear_mps * interval_s * (sin_turned / sin_half if abs(half_rad) > 1e-12 else moves)
        x_m = pose.x_m + chord_m * (cos_mid * cos_half + sin_mid * sin_half)
        y_m = pose.y_m + chord_m * (sin_mid * cos_half - cos_mid * sin_half)
        cos_end, sin_end = cos_mid * cos_turned - sin_mid * sin_turned, sin_mid * cos_turned + cos_mid * sin_turned
        is_sure = limits.use_dwa
        for along_m in (x_m, y_m, x_m + nose_m * cos_end, y_m + nose_m * sin_end):
            is_sure &= abs(along_m * per_m - math.floor(along_m * per_m + 0.5)) >= ROUNDING_CELLS
        if not is_sure:
            least[index] = 0.0
        elif 0 <= math.floor(y_m * per_m) < rows and 0 <= math.floor(x_m * per_m) < columns:
            place = (x_m, y_m, cos_end, sin_end)
            here = _distance_costs(costs, per_m, cells, queues, counts, scales, place, nose_m)
            if here[0] >= 0.0:
                total = scales[OBSTACLE] * obstacle + here[0] + here[1] + here[2] + here[3]
                least[index] = total + scales[TWIRLING] * abs(angular_radps)
    return least, steps


@compiled
def find_cheapest(
    task: ScoringTask, origin: Pose2D, plan: Array, base_pose: Pose2D
) -> Tuple[float, float, float, np.ndarray]:
    """Begin the waves at a plan (n, 3), n > 0, and return the cheapest sample's velocities, cost and trajectory (n, 5).

    The cost is inf if all samples are rejected, or the plan is off the grid. Poses are in the frame of its origin.
    """
    limits, twist = task.limits, task.twist
    if not begin_waves(task, origin, plan):
        return 0.0, 0.0, math.inf, np.empty((0, 5))
    samples = velocity_samples(limits, twist, task.goal_distance_m)
    least, steps = _least_costs(task, samples)
    points = np.empty((steps.max(), 5))
    best, cost = -1, math.inf
    while True:
        index = int(np.argmin(least))
        if least[index] == math.inf or least[index] > cost or (least[index] == cost and index > best):
            break
        least[index] = math.inf
        sample, trajectory = (samples[index, 0], samples[index, 1]), points[: steps[index]]
        _roll_out(limits, task.pose_in_grid, twist, sample, trajectory)
        total = _score(task, sample[1], trajectory, cost)
        if 0.0 <= total < cost or (total == cost and index < best):
            best, cost = index, total
    if best < 0:
        return 0.0, 0.0, math.inf, np.empty((0, 5))
    sample, points = (samples[best, 0], samples[best, 1]), np.empty((steps[best], 5))
    _roll_out(limits, base_pose, twist, sample, points)
    if not limits.use_dwa:
        sample = _accelerated(limits, twist, sample, limits.sim_time / steps[best])
    return sample[0], sample[1], cost, points


@compiled
def score_all(task: ScoringTask) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return samples (n, 2), numbers of points (n,), points (n, most, 5), and costs (n,), < 0 if rejected."""
    samples = velocity_samples(task.limits, task.twist, task.goal_distance_m)
    steps = np.array([sample_steps(task.limits, (sample[0], sample[1]), task.allowed) for sample in samples])
    points, totals = np.empty((len(samples), steps.max(), 5)), np.full(len(samples), REJECTED)
    for index in range(len(samples)):
        sample, trajectory = (samples[index, 0], samples[index, 1]), points[index, : steps[index]]
        if steps[index] > 0:
            _roll_out(task.limits, task.pose_in_grid, task.twist, sample, trajectory)
            totals[index] = _score(task, sample[1], trajectory, math.inf)
    return samples, steps, points, totals


@compiled
def velocity_samples(limits: DwaLimits, twist: Twist, goal_distance_m: float) -> np.ndarray:
    """Return samples (n, 2) linear [m/s], angular [rad/s] that are reachable within the horizon, the angular innermost.

    Without use_dwa, none passes the goal in that time. Of a twist above the limits, the window is the limit.
    """
    lowest_mps, highest_mps, highest_radps = limits.min_vel_x, limits.max_vel_x, limits.max_vel_theta
    if not limits.use_dwa:
        highest_mps = max(min(highest_mps, goal_distance_m / limits.horizon_s), lowest_mps)
    linear = _samples_around(twist[0], limits.acc_lim_x * limits.horizon_s, lowest_mps, highest_mps, limits.vx_samples)
    angular_change = limits.acc_lim_theta * limits.horizon_s
    angular = _samples_around(twist[1], angular_change, -highest_radps, highest_radps, limits.vth_samples)
    samples = np.empty((len(linear) * len(angular), 2))
    for index in range(len(samples)):
        samples[index, 0], samples[index, 1] = linear[index // len(angular)], angular[index % len(angular)]
    return samples


@compiled
def _samples_around(now: float, change: float, lowest: float, highest: float, count: int) -> np.ndarray:
    """Return evenly spaced samples of the limited window around a velocity, with both ends, and 0 if it is between."""
    low, high = _clamped(now - change, lowest, highest), _clamped(now + change, lowest, highest)
    if low == high:
        return np.array([low])
    count = max(2, count)  # as upstream's VelocityIterator
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
def _clamped(value: float, lowest: float, highest: float) -> float:
    return min(max(value, lowest), highest)


@compiled
def _step_count(limits: DwaLimits, sample: Twist) -> int:
    """Return the number of points of a trajectory, so that none are farther apart than the granularities."""
    along = abs(sample[0]) * limits.sim_time / limits.sim_granularity
    return int(math.ceil(max(along, abs(sample[1]) * limits.sim_time / limits.angular_sim_granularity)))


@compiled
def sample_steps(limits: DwaLimits, sample: Twist, allowed: Tuple[bool, bool, bool, bool]) -> int:
    """Return the number of points of a sample's trajectory, 0 if it is too slow, too fast or in a locked direction."""
    speed_mps = abs(sample[0])
    is_too_slow = speed_mps + 1e-4 < limits.min_vel_trans and abs(sample[1]) + 1e-4 < limits.min_vel_theta
    is_locked = (sample[0] > 0 and not allowed[0]) or (sample[0] < 0 and not allowed[1])
    is_locked |= (sample[1] > 0 and not allowed[2]) or (sample[1] < 0 and not allowed[3])
    return 0 if is_too_slow or is_locked or speed_mps - 1e-4 > limits.max_vel_trans else _step_count(limits, sample)


@compiled
def _accelerated(limits: DwaLimits, twist: Twist, sample: Twist, interval_s: float) -> Twist:
    """Return the twist after an interval of acceleration towards a sample."""
    linear_change, angular_change = limits.acc_lim_x * interval_s, limits.acc_lim_theta * interval_s
    return (
        _clamped(sample[0], twist[0] - linear_change, twist[0] + linear_change),
        _clamped(sample[1], twist[1] - angular_change, twist[1] + angular_change),
    )


@compiled
def _roll_out(limits: DwaLimits, pose: Pose2D, twist: Twist, sample: Twist, points: Array) -> None:
    """Fill `points` (n, 5) from a pose on: x, y, yaw, cos(yaw), sin(yaw); without use_dwa, the robot accelerates."""
    interval_s = limits.sim_time / max(1, len(points))
    x_m, y_m, yaw_rad = pose
    velocity = sample if limits.use_dwa else twist
    for step in range(len(points)):
        cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
        points[step, 0], points[step, 1], points[step, 2] = x_m, y_m, yaw_rad
        points[step, 3], points[step, 4] = cos_yaw, sin_yaw
        if not limits.use_dwa:
            velocity = _accelerated(limits, velocity, sample, interval_s)
        x_m += velocity[0] * cos_yaw * interval_s
        y_m += velocity[0] * sin_yaw * interval_s
        yaw_rad += velocity[1] * interval_s
