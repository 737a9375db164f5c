"""robot_settings: the parameters that follow from a robot. Its help is in robot_settings_arguments."""

from __future__ import annotations

import argparse
import sys
from typing import Any, Dict, List, Optional, Sequence

import yaml

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import users_path
from diff_encoder_sim.base.params import nested
from diff_encoder_sim.base.text_values import for_xml_rpc
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.cli.launched_robot import OWN_PPR, LaunchedRobot, launched_robot
from diff_encoder_sim.cli.robot_settings_arguments import parse
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.trials.robot_params import check_key
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS

# What campaigns set by themselves, and launch files by their arguments.
SET_BY_ARGUMENTS = (OWN_PPR, 'config.seed')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('robot_settings', lambda: _print_settings(parse(arguments)))


def _print_settings(options: argparse.Namespace) -> None:
    robot = launched_robot(options, launch_arguments(options.values), _of_bag(options.bag) if options.bag else {})
    for note in robot.notes:
        print(f'robot_settings: {note}', file=sys.stderr)
    settings = for_xml_rpc(nested(robot.settings))
    print(yaml.safe_dump({**settings, **_of_poses(robot)}, sort_keys=False))


def _of_poses(robot: LaunchedRobot) -> Dict[str, Any]:
    """Return the parameters of the nodes that have no file in config/."""
    model, base_frame = robot.setup.name, robot.params.odometry.base_frame
    return {
        'slam': {'base_frame': base_frame},
        'world_pose': {'model': model},
        'ideal_odom': {'model': model, 'base_frame': base_frame},
        'global_pose': {'base_frame': base_frame},
    }


def _of_bag(given: str) -> Dict[str, Any]:
    """Return the seed of a bag's trial, and what its covariance knew of the wheels, as `reencode` takes them."""
    path = users_path(given)
    try:
        with open_source(path) as source:
            trial = trial_of_source(path, source)
    except ConfigError:
        return {}  # replay_node, which plays it, says what is wrong
    if trial is None:
        return {}
    return {'config.seed': trial.number, **{f'config.{key}': getattr(trial, key) for key in UNCERTAINTY_KEYS}}


def launch_arguments(words: List[str]) -> Dict[str, Any]:
    """Read FILE.KEY:=VALUE, the value as YAML; one without a value is not given.

    Raises:
        ConfigError: a word is none.
    """
    values = {}
    for word in words:
        key, separator, text = word.partition(':=')
        if not (key and separator):
            raise ConfigError(f'arguments: given {word!r}; allowed: FILE.KEY:=VALUE')
        if key not in SET_BY_ARGUMENTS:
            check_key(key)
        if text:
            values[key] = yaml_value(text, key)
    return values
