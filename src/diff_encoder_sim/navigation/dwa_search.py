"""Search of the dynamic window for the cheapest trajectory, best first: one call of a kernel in a control period.

A trajectory costs at least what its last point does by its distances from the plan, and its first one, which is that of
all, by its obstacles. A closed form tells the cells of last points: all but a few samples need no trajectory.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.critics import CRITICS, NO_TRAJECTORY, OSCILLATES, OSCILLATION
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.trajectory_scoring import (
    Scene,
    begin_waves,
    least_cost,
    score_trajectory,
    standing_cost,
)


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
