"""Rollout of velocity samples into trajectories: base_local_planner's SimpleTrajectoryGenerator."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled


@compiled
def step_count(
    linear_mps: float, angular_radps: float, sim_time_s: float, granularity_m: float, angular_granularity_rad: float
) -> int:
    """Return the number of points of a trajectory, so that none are farther apart than the granularities."""
    return math.ceil(
        max(abs(linear_mps) * sim_time_s / granularity_m, abs(angular_radps) * sim_time_s / angular_granularity_rad)
    )


@compiled
def approach(value: float, target: float, largest_step: float) -> float:
    """Move `value` towards `target` by no more than a step."""
    if value < target:
        return min(target, value + largest_step)
    return max(target, value - largest_step)


@compiled
def roll_out(
    pose: np.ndarray,
    twist: np.ndarray,
    sample: np.ndarray,
    steps: int,
    sim_time_s: float,
    accelerations: np.ndarray,
    accelerates: bool,
    points: np.ndarray,
) -> None:
    """Fill `points` (steps, 3) x, y, yaw from the start pose (3,) on, without the end of the last step.

    Twist and sample (2,) are in m/s and rad/s. If it `accelerates`, the velocity goes from the twist to the sample
    at the limits (2,) [m/s^2], [rad/s^2], else it is the sample at once.
    """
    interval_s = sim_time_s / steps
    x_m, y_m, yaw_rad = pose[0], pose[1], pose[2]
    linear_mps, angular_radps = sample[0], sample[1]
    if accelerates:
        linear_mps, angular_radps = twist[0], twist[1]
    for step in range(steps):
        points[step, 0], points[step, 1], points[step, 2] = x_m, y_m, yaw_rad
        if accelerates:
            linear_mps = approach(linear_mps, sample[0], accelerations[0] * interval_s)
            angular_radps = approach(angular_radps, sample[1], accelerations[1] * interval_s)
        x_m += linear_mps * math.cos(yaw_rad) * interval_s
        y_m += linear_mps * math.sin(yaw_rad) * interval_s
        yaw_rad += angular_radps * interval_s


@compiled
def roll_out_all(
    pose: np.ndarray,
    twist: np.ndarray,
    samples: np.ndarray,
    simulation: np.ndarray,
    limits: np.ndarray,
    accelerations: np.ndarray,
    accelerates: bool,
) -> Tuple[np.ndarray, np.ndarray]:
    """Return the points (n, most steps, 3) of samples (n, 2) and their numbers (n,), 0 for no trajectory.

    `simulation` (3,) is the time [s] and the granularities [m], [rad]; `limits` (3,) are the least and the highest
    translation [m/s] and the least turn [rad/s]; the others as in `roll_out`.
    """
    steps = np.zeros(len(samples), np.int64)
    for index in range(len(samples)):
        linear_mps, angular_radps = abs(samples[index, 0]), abs(samples[index, 1])
        is_too_slow = linear_mps + 1e-4 < limits[0] and angular_radps + 1e-4 < limits[2]
        if not is_too_slow and linear_mps - 1e-4 <= limits[1]:
            steps[index] = step_count(linear_mps, angular_radps, simulation[0], simulation[1], simulation[2])
    points = np.empty((len(samples), steps.max(), 3))
    for index in range(len(samples)):
        count = steps[index]
        if count > 0:
            roll_out(pose, twist, samples[index], count, simulation[0], accelerations, accelerates, points[index])
    return points, steps
