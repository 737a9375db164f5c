"""How far from a goal each `stop` may end by the pose estimate: so much of the tolerances is spent before any error."""

from __future__ import annotations

import math
from typing import NamedTuple

from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.precise_stop import NEAR, SET_OUT, approach_speed, stopping_rest


class StopSpread(NamedTuple):
    """Distance from the goal and difference of heading."""

    position_m: float
    yaw_rad: float


class PoseStep(NamedTuple):
    """What a pose of odometry moves by at least: a pulse of both wheels ahead, of one around."""

    position_m: float
    yaw_rad: float


def stop_spread(params: DwaParams, period_s: float, command_latency_s: float, step: PoseStep) -> StopSpread:
    """Return the spread of a robot that has driven up to its goal, as steps of the control loop leave it.

    Args:
        params: tolerances and limits.
        period_s: the control period [s].
        command_latency_s: from a pose to the wheels [s].
        step: of the odometry.
    """
    tolerance_m, tolerance_rad = params.xy_goal_tolerance, params.yaw_goal_tolerance
    if params.stop == 'latch':
        margin = params.latch_margin if params.latch_xy_goal_tolerance else 0.0
        return StopSpread((1.0 - margin) * tolerance_m, tolerance_rad)
    speed_mps = approach_speed(params, period_s, NEAR * tolerance_m)
    along_m = stopping_rest(speed_mps, params.acc_lim_x, period_s) + speed_mps * command_latency_s + step.position_m
    rate_radps = params.min_vel_theta
    turn_rad = stopping_rest(rate_radps, params.acc_lim_theta, period_s) + rate_radps * command_latency_s + step.yaw_rad
    return StopSpread(
        min(tolerance_m, math.hypot(along_m, NEAR * tolerance_m)),
        min(tolerance_rad, max(SET_OUT * tolerance_rad, turn_rad)),
    )
