"""The parameters of all parts of a robot, as the YAML files of config/ give them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, Iterator, Mapping, NamedTuple, Optional, Type, Union

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, did_you_mean, merged, nested, split_params
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.trials.latency import LatencyParams
from diff_encoder_sim.trials.wheel_uncertainty import with_uncertainty
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# The files by their stems, each with the fields of RobotParams that it sets.
CONFIG_FILES: Dict[str, Dict[str, Type[Params]]] = {
    'config': {'encoder': EncoderParams, 'odometry': OdometryParams},
    'simulator': {'simulator': SimulatorParams},
    'amcl': {'amcl': AmclParams},
    'navigation': {'navigator': NavigatorParams},
    'lockstep': {'latency': LatencyParams},
}

# Keys that a trial sets itself, with what sets them: an override would have no effect.
SET_BY_TRIALS = {
    'config.ppr': "the campaign's ppr",
    'config.ppr.left': "the campaign's ppr",
    'config.ppr.right': "the campaign's ppr",
    'config.seed': "the trial's number",
    'amcl.initial_pose_x': "the test's start",
    'amcl.initial_pose_y': "the test's start",
    'amcl.initial_pose_a': "the test's start",
}

RobotConfig = Dict[str, Dict[str, Any]]


class RobotParams(NamedTuple):
    """The parameters of each part, as its node reads them; odometry is told of the simulated wheels' errors."""

    encoder: EncoderParams
    odometry: OdometryParams
    simulator: SimulatorParams
    amcl: AmclParams
    navigator: NavigatorParams
    latency: LatencyParams


def load_robot_params(config_folder: Union[str, Path]) -> RobotParams:
    """Load the parameters that trial.launch gives its nodes.

    Raises:
        ConfigError: a file is missing or bad.
    """
    paths = _paths(config_folder)
    return _checked_params(paths, _load_files(paths))


def load_robot_config(config_folder: Union[str, Path], instead: Optional[Mapping[str, Path]] = None) -> RobotConfig:
    """Load the content of the files by their stems, for `override`.

    Args:
        config_folder: where the files are.
        instead: files, by stem, that are read in place of the folder's.

    Raises:
        ConfigError: a file is missing or bad.
    """
    paths = {**_paths(config_folder), **(instead or {})}
    config = _load_files(paths)
    _checked_params(paths, config)
    return config


def _checked_params(paths: Mapping[str, Path], config: RobotConfig) -> RobotParams:
    """Return the parameters of the files; errors name the file."""
    return _robot_params(config, lambda stem: str(paths[stem]))


def override(config: RobotConfig, overrides: Mapping[str, Any]) -> RobotParams:
    """Return the parameters with other values for some keys.

    Args:
        config: from `load_robot_config`.
        overrides: values by dotted keys that begin with the stem of a file, such as `simulator.lidar.noise`; see
            `check_key`.

    Raises:
        ConfigError: a value is not allowed, or another key decides what this one should.
    """
    params = _robot_params(merged(config, nested(overrides)), str)
    for key, value in overrides.items():
        _check_effect(params, key, value)
    return params


def check_key(key: str) -> None:
    """Check that `override` knows a dotted key.

    Raises:
        ConfigError: there is no such parameter, or trials set it themselves.
    """
    if key in SET_BY_TRIALS:
        raise ConfigError(f'{key}: every trial sets it; allowed: {SET_BY_TRIALS[key]}')
    known = [
        f'{stem}.{name}'
        for stem, classes in CONFIG_FILES.items()
        for params_class in classes.values()
        for name in _dotted_keys(params_class)
    ]
    if key not in known:
        hint = did_you_mean(key, known) or '; allowed: a parameter of a file of config/, such as simulator.lidar.noise'
        raise ConfigError(f'{key}: unknown key{hint}')


def _paths(config_folder: Union[str, Path]) -> Dict[str, Path]:
    return {stem: Path(config_folder) / f'{stem}.yaml' for stem in CONFIG_FILES}


def _load_files(paths: Mapping[str, Path]) -> RobotConfig:
    return {stem: load_yaml(path) for stem, path in paths.items()}


def _robot_params(config: RobotConfig, source: Callable[[str], str]) -> RobotParams:
    """Check each file's content; `source` returns from its stem what an error names it by."""
    parts: Dict[str, Any] = {}
    for stem, classes in CONFIG_FILES.items():
        parts.update(zip(classes, split_params(config[stem], source(stem), *classes.values())))
    parts['odometry'] = with_uncertainty(parts['odometry'], parts['simulator'].wheel_errors)
    return RobotParams(**parts)


def _dotted_keys(params_class: Type[Params]) -> Iterator[str]:
    """Yield the keys of single values: of costmaps their flat names alone, which have namespaces as aliases."""
    for name, field in params_class.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Params):
            yield from (f'{name}.{below}' for below in _dotted_keys(field.annotation))
        else:
            yield name


def _check_effect(params: RobotParams, key: str, value: Any) -> None:
    """Check that a parameter has its value: in move_base's overlapping namespaces another key can set it again."""
    stem, *path = key.split('.')
    parts = [getattr(params, field) for field in CONFIG_FILES[stem]]
    used: Any = next(part for part in parts if path[0] in type(part).model_fields)
    for name in path:
        used = getattr(used, name)
    if isinstance(used, (bool, int, float, str)) and used != value:
        raise ConfigError(f'{key}: given {value!r} has no effect: another key of config/{stem}.yaml makes it {used!r}')
