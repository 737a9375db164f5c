"""The parameters of a robot with one of a campaign's encoders."""

from __future__ import annotations

from typing import Any, Mapping

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.robot_params import RobotConfig, RobotParams, override
from diff_encoder_sim.wheels.chosen_encoder import RESOLUTION_KEYS, ChosenEncoder, resolution_text


def encoder_parameters(
    config: RobotConfig, of_robot: Mapping[str, Any], encoder: ChosenEncoder, of_campaign: Mapping[str, Any]
) -> RobotParams:
    """Return all parameters.

    Args:
        config: content of the files of config/.
        of_robot: values of the robot by dotted keys, before which the encoder's come.
        encoder: what the wheels have.
        of_campaign: values by dotted keys, which come before all.

    Raises:
        ConfigError: a value is not allowed, or sets counts other than the encoder's.
    """
    # The robot's own encoder gives way.
    values = {key: value for key, value in of_robot.items() if key not in RESOLUTION_KEYS}
    params = override(config, {**values, **encoder.overrides, **of_campaign})
    counts = params.encoder.encoder.counts_per_wheel_turn
    if counts != (encoder.real and encoder.ppr.left):
        given = resolution_text(params.encoder.encoder) or 'no resolution'
        beside = f'encoders: {encoder.label}' if encoder.real else f'ppr: {encoder.label}'
        raise ConfigError(f'config.encoder: given {given} beside {beside}; allowed: one of them')
    return params
