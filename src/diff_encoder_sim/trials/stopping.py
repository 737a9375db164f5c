"""What the robot's own way of stopping leaves of the tolerances at a goal, in words."""

from __future__ import annotations

import math
from typing import Dict, Sequence, Tuple

from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.goal_stopping import PoseStep, StopSpread, stop_parts, stop_spread
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.wheels.encoder_params import PerWheel, ppr_label

# How each stop ends.
_ENDS = {'latch': 'ends anywhere within', 'precise': 'drives up to within about'}


def spread_with(params: RobotParams, ppr: PerWheel) -> StopSpread:
    """Return how far from a goal the robot stops with an encoder, by the pose estimate."""
    return stop_spread(*_loop(params, ppr))


def parts_with(params: RobotParams, ppr: PerWheel) -> Dict[str, StopSpread]:
    """Return the same by its causes."""
    return stop_parts(*_loop(params, ppr))


def _loop(params: RobotParams, ppr: PerWheel) -> Tuple[DwaParams, float, float, PoseStep]:
    """Return what the control loop makes of a stop."""
    odometry, navigator = params.odometry, params.navigator
    pulse_m = math.pi * odometry.wheel_diameter / min(ppr.left, ppr.right)
    step = PoseStep(pulse_m, pulse_m / odometry.wheel_separation)
    return navigator.DWAPlannerROS, navigator.control_period_s, params.latency.command, step


def stopping_line(params: RobotParams, pprs: Sequence[PerWheel]) -> str:
    """Say how a robot stops with its encoders, and which tolerances are asked for."""
    planner = params.navigator.DWAPlannerROS
    spreads = sorted((spread_with(params, ppr), ppr_label(ppr)) for ppr in pprs)
    (least, finest), (most, coarsest) = spreads[0], spreads[-1]
    ends = f'{_words(least)} of the goal'
    if least != most:
        ends = f'{ends} with {finest} PPR, {_words(most)} with {coarsest} PPR'
    asked = StopSpread(planner.xy_goal_tolerance, planner.yaw_goal_tolerance)
    return f'stopping: {planner.stop} {_ENDS[planner.stop]} {ends}; asked for: {_words(asked)}'


def as_upstream(params: RobotParams) -> RobotParams:
    """Return the parameters as upstream's move_base has them, which knows neither `stop` nor `latch_margin`."""
    planner = params.navigator.DWAPlannerROS.model_copy(update={'stop': 'latch', 'latch_margin': 0.0})
    return params._replace(navigator=params.navigator.model_copy(update={'DWAPlannerROS': planner}))


def _words(spread: StopSpread) -> str:
    return f'{1e3 * spread.position_m:.0f} mm and {math.degrees(spread.yaw_rad):.1f} degrees'
