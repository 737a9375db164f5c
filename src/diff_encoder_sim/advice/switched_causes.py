"""Causes of errors that closed-loop trials can do without: as sets of parameters of a campaign."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Sequence

from diff_encoder_sim.advice.drawn_robot import WheelCause
from diff_encoder_sim.advice.odometry_budget import EDGES, MISSED, SENSOR_ERRORS, UNEVEN_LINES
from diff_encoder_sim.base.params import flat
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS

AS_IT_IS, WITHOUT_ALL = 'as it is', 'without all of these'
_WITHOUT = 'without '

_WHEELS, _ENCODER, _FAULTS = 'simulator.wheel_errors', 'config.encoder', 'config.encoder.faults'

# The keys of each cause.
_CAUSES: Mapping[str, Mapping[str, Sequence[str]]] = {
    WheelCause.RADIUS.value: {_WHEELS: ('left_radius_error', 'right_radius_error', 'radius_spread')},
    WheelCause.SEPARATION.value: {_WHEELS: ('wheel_separation_error', 'wheel_separation_spread')},
    WheelCause.SLIP.value: {_WHEELS: ('left_slip', 'right_slip', 'slip_noise')},
    EDGES: {_ENCODER: (*SENSOR_ERRORS, *UNEVEN_LINES)},
    MISSED: {_FAULTS: ('missed', 'extra', 'max_count_rate', 'dead_channel', 'restart_at', 'wiring')},
}

_SOUND = {
    **{f'{_WHEELS}.{key}': value for key, value in flat(WheelErrorParams().model_dump())},
    **{f'{_ENCODER}.{key}': value for key, value in flat(IDEAL_ENCODER.model_dump(exclude={'faults'}))},
    **{f'{_FAULTS}.{key}': value for key, value in flat(NO_FAULTS.model_dump())},
}


def switched_off(robots: Sequence[RobotParams]) -> Dict[str, Dict[str, Any]]:
    """Return, by the name of a set of parameters, the values without each cause that one of the robots has.

    The first set is the robot as it is, the last one without all of these causes; {} where there is no cause.

    Args:
        robots: with each encoder.
    """
    values = [_values(robot) for robot in robots]
    without: Dict[str, Dict[str, Any]] = {}
    for cause, by_part in _CAUSES.items():
        keys = [f'{part}.{key}' for part, names in by_part.items() for key in names]
        if any(of_robot[key] != _SOUND[key] for of_robot in values for key in keys):
            without[f'{_WITHOUT}{cause}'] = {key: _SOUND[key] for key in keys}
    if not without:
        return {}
    every = {key: value for each in without.values() for key, value in each.items()}
    return {AS_IT_IS: {}, **without, WITHOUT_ALL: every}


def cause_of(variant: str) -> str:
    """Return the cause that a set of parameters is without."""
    return variant[len(_WITHOUT) :]


def _values(robot: RobotParams) -> Dict[str, Any]:
    wheels, encoder = robot.simulator.wheel_errors.model_dump(), robot.encoder.encoder.model_dump()
    return {
        **{f'{_WHEELS}.{key}': value for key, value in flat(wheels)},
        **{f'{_ENCODER}.{key}': value for key, value in flat(encoder)},
    }
