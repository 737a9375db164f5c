"""The parameters of a robot's every part, as the files of config/ give them."""
from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Union

from diff_encoder_sim.config import load_params, load_yaml, split_params
from diff_encoder_sim.encoder import EncoderParams
from diff_encoder_sim.localization.params import AmclParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.odometry import OdometryParams
from diff_encoder_sim.simulation.simulator import SimulatorParams


class RobotParams(NamedTuple):
    """The YAML files of config/, each as its nodes read it."""

    encoder: EncoderParams
    odometry: OdometryParams
    simulator: SimulatorParams
    amcl: AmclParams
    navigator: NavigatorParams


def load_robot_params(config_folder: Union[str, Path]) -> RobotParams:
    """What trial.launch gives its nodes.

    Raises:
        ConfigError: a file is missing or bad.
    """
    folder = Path(config_folder)
    wheels = folder / 'config.yaml'
    encoder, odometry = split_params(load_yaml(wheels), str(wheels), EncoderParams, OdometryParams)
    return RobotParams(encoder, odometry, load_params(SimulatorParams, folder / 'simulator.yaml'),
                       load_params(AmclParams, folder / 'amcl.yaml'),
                       load_params(NavigatorParams, folder / 'navigation.yaml'))
