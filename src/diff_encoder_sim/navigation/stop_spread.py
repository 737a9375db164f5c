"""How far from a goal each `stop` may end by the pose estimate: so much of the tolerances is spent before any error."""

from __future__ import annotations

import math
from typing import Dict, NamedTuple

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


# Causes of a spread.
LATCH, COASTING, LATENCY, PULSE, NEAR_ENOUGH = 'latch circle', 'coasting', 'latency', 'one pulse', 'near enough'


def stop_parts(params: DwaParams, period_s: float, command_latency_s: float, step: PoseStep) -> Dict[str, StopSpread]:
    """Return what a robot that has driven up to its goal may be off by for each cause, as the control loop leaves it.

    Args:
        params: tolerances and limits.
        period_s: the control period [s].
        command_latency_s: from a pose to the wheels [s].
        step: of the odometry.
    """
    tolerance_m, tolerance_rad = params.xy_goal_tolerance, params.yaw_goal_tolerance
    if params.stop == 'latch':
        margin = params.latch_margin if params.latch_xy_goal_tolerance else 0.0
        return {LATCH: StopSpread((1.0 - margin) * tolerance_m, tolerance_rad)}
    speed_mps, rate_radps = approach_speed(params, period_s, NEAR * tolerance_m), params.min_vel_theta
    return {
        COASTING: StopSpread(
            stopping_rest(speed_mps, params.acc_lim_x, period_s),
            stopping_rest(rate_radps, params.acc_lim_theta, period_s),
        ),
        LATENCY: StopSpread(speed_mps * command_latency_s, rate_radps * command_latency_s),
        PULSE: StopSpread(step.position_m, step.yaw_rad),
        NEAR_ENOUGH: StopSpread(NEAR * tolerance_m, SET_OUT * tolerance_rad),
    }


def stop_spread(params: DwaParams, period_s: float, command_latency_s: float, step: PoseStep) -> StopSpread:
    """Return the spread of a robot that has driven up to its goal; arguments as of `stop_parts`.

    Ahead, what coasts, is late and is counted adds up, across the robot is as near as it has to be; of the heading, the
    larger one of both.
    """
    parts = stop_parts(params, period_s, command_latency_s, step)
    if LATCH in parts:
        return parts[LATCH]
    ahead = [parts[COASTING], parts[LATENCY], parts[PULSE]]
    along_m, turn_rad = sum(part.position_m for part in ahead), sum(part.yaw_rad for part in ahead)
    near = parts[NEAR_ENOUGH]
    return StopSpread(
        min(params.xy_goal_tolerance, math.hypot(along_m, near.position_m)),
        min(params.yaw_goal_tolerance, max(near.yaw_rad, turn_rad)),
    )
