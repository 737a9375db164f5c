"""The robot of a launch file, and the parameters that its nodes run with.

Precedence, the strongest first: launch arguments (ppr:= or encoder:=, lidar_noise:=); what a YAML file that the user
gives (config:=, navigation_config:=, ...) has otherwise than the package's file of that name; the robot file's `set`;
what was found out from the URDF; the package's files of config/.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import flat, split_params
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.cli.launch_arguments import FILE_OPTIONS
from diff_encoder_sim.robots.robot_setup import RobotSetup
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments_of_text
from diff_encoder_sim.trials.robot_loading import load_robot
from diff_encoder_sim.trials.robot_params import CONFIG_FILES, RobotParams, override
from diff_encoder_sim.trials.wheel_uncertainty import uncertainty_of_robot
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, chosen, load_encoder, own_encoder
from diff_encoder_sim.wheels.diagnostics import hidden_encoder
from diff_encoder_sim.wheels.odometry_params import OdometryParams

OWN_PPR, OWN_NOISE = 'config.ppr', 'config.motion_noise'
SIMULATED = 'pybullet'  # the simulator whose wheels have the errors of the parameters
_ABSENT = object()


class LaunchedRobot(NamedTuple):
    """A robot and what its nodes run with."""

    setup: RobotSetup
    settings: Dict[str, Any]  # by dotted keys: what replaces the values of the YAML files
    params: RobotParams
    encoder: ChosenEncoder  # of encoder:=, or as the parameters have it
    notes: List[str]  # where a YAML file goes before the robot, or a default hides the encoder; a line each


def launched_robot(
    options: argparse.Namespace, arguments: Mapping[str, Any], usual: Optional[Mapping[str, Any]] = None
) -> LaunchedRobot:
    """Return the robot that a launch file's options name.

    Args:
        options: those of `add_launched_robot`, `robot`, and `sim`, which simulates the wheels.
        arguments: launch arguments by dotted keys.
        usual: values by dotted keys that go before the package's files alone.

    Raises:
        ConfigError: a file is missing or bad, or a value is not allowed.
    """
    setup, encoder = _setup(options), _encoder(options, arguments)
    files = _files(options)
    theirs = _users_values(files)
    settings = {**(usual or {}), **_config(uncertainty_of_robot(setup.settings)), **setup.settings}
    if setup.file.ppr is not None:
        settings[OWN_PPR] = setup.file.ppr
    is_noise_given = any(OWN_NOISE in values for values in (settings, theirs, arguments))
    if options.sim != SIMULATED:  # its wheels are told of when they are known
        settings = {**_config(OdometryParams().uncertainty), **settings}
    replaced = {key for key in settings if any(_overlap(key, other) for other in theirs)}
    notes = [
        f'{key}: as in {files[key.partition(".")[0]]}, not {settings[key]!r} as in {setup.file.where}'
        for key in sorted(replaced & {*setup.file.overrides, OWN_PPR})
    ]
    given = {**(_overrides(encoder) if encoder else {}), **arguments}
    if OWN_PPR in given:
        replaced.update(RESOLUTION_KEYS)  # the robot's own encoder gives way
    settings = {key: value for key, value in settings.items() if key not in replaced}
    settings = {**_missing_costmaps(files), **settings, **given}
    params = _checked(files, settings)
    if OWN_PPR in given and encoder is None:
        _check_no_resolution(files['config'], params, given[OWN_PPR])
    settings.update(_config(params.odometry.uncertainty))
    if options.sim != SIMULATED and not is_noise_given:
        notes += filter(None, [hidden_encoder(params.odometry)])
    return LaunchedRobot(setup, settings, params, encoder or own_encoder(params.encoder), notes)


def _files(options: argparse.Namespace) -> Dict[str, str]:
    """Return the paths of the YAML files by their stems: as given, else the package's."""
    given = {stem: getattr(options, option[2:].replace('-', '_')) for stem, option in FILE_OPTIONS.items()}
    folder = package_folder() / 'config'
    return {stem: str(folder / f'{stem}.yaml') if path is None else path for stem, path in given.items()}


def _config(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Return values of config.yaml by dotted keys."""
    return {f'config.{key}': value for key, value in values.items()}


def _encoder(options: argparse.Namespace, arguments: Mapping[str, Any]) -> Optional[ChosenEncoder]:
    if not options.encoder:
        return None
    if OWN_PPR in arguments:
        raise ConfigError(f'encoder: given {options.encoder} beside ppr {arguments[OWN_PPR]}; allowed: one of them')
    return chosen(load_encoder(options.encoder, package_folder() / 'config', _users_folder()))


def _overrides(encoder: ChosenEncoder) -> Dict[str, Any]:
    """Return what an encoder sets; the parameter server knows no None."""
    return {key: value for key, value in encoder.overrides.items() if value is not None}


def _check_no_resolution(file: str, params: RobotParams, ppr: Any) -> None:
    resolution = own_encoder(params.encoder).resolution
    if resolution:
        raise ConfigError(f'{file}: encoder: given {resolution} beside ppr {ppr}; allowed: one of them')


def _setup(options: argparse.Namespace) -> RobotSetup:
    return load_robot(options.robot, _users_folder(), package_folder(), xacro_arguments_of_text(options.robot_args))


def _users_folder() -> Path:
    """Return the folder in which roslaunch was started: it starts its commands in one of its own."""
    return Path(os.environ.get('PWD', '.'))


def _users_values(files: Mapping[str, str]) -> Dict[str, Any]:
    """Return what the user's files have otherwise than the package's, by dotted keys."""
    values: Dict[str, Any] = {}
    for stem, path in files.items():
        own = package_folder() / 'config' / f'{stem}.yaml'
        if Path(path).resolve() != own.resolve():
            usual = dict(flat(load_yaml(own)))
            given = flat(load_yaml(path))
            values.update({f'{stem}.{key}': value for key, value in given if usual.get(key, _ABSENT) != value})
    return values


def _missing_costmaps(files: Mapping[str, str]) -> Dict[str, Any]:
    """Return the package's costmaps that the user's file leaves out: outline and frame alone make none."""
    usual, given = load_yaml(package_folder() / 'config' / 'navigation.yaml'), load_yaml(files['navigation'])
    missing = {name: usual[name] for name in ('global_costmap', 'local_costmap') if name not in given}
    return {f'navigation.{key}': value for key, value in flat(missing)}


def _overlap(key: str, other: str) -> bool:
    """Return whether two dotted keys name the same value, or one is a part of the other."""
    return f'{key}.'.startswith(f'{other}.') or f'{other}.'.startswith(f'{key}.')


def _checked(files: Mapping[str, str], settings: Mapping[str, Any]) -> RobotParams:
    config = {stem: load_yaml(files.get(stem, package_folder() / 'config' / f'{stem}.yaml')) for stem in CONFIG_FILES}
    for stem, classes in CONFIG_FILES.items():
        split_params(config[stem], str(files.get(stem, stem)), *classes.values())  # alone, so that an error is its own
    return override(config, settings)
