"""Search of the dynamic window for the cheapest trajectory, best first: one call of a kernel in a control period.

A trajectory costs at least what its last point does by its distances from the plan, and its first one, which is that of
all, by its obstacles. A closed form tells the cells of last points: all but a few samples need no trajectory.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.critics import CRITICS, NO_TRAJECTORY, OSCILLATES, OSCILLATION
from diff_encoder_sim.navigation.dynamic_window import WindowParams, velocity_samples
from diff_encoder_sim.navigation.plan_distances import begin_waves
from diff_encoder_sim.navigation.trajectory_rollout import (
    RolloutParams,
    approach,
    last_point,
    roll_out,
    sample_step_count,
)
from diff_encoder_sim.navigation.trajectory_scoring import Scene, least_cost, score_trajectory, standing_cost


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
