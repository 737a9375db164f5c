"""Rollout of velocity samples into trajectories: base_local_planner's SimpleTrajectoryGenerator."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.dwa_params import DwaParams


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
