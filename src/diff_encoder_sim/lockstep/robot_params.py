"""The parameters of a robot's every part, as the files of config/ give them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Tuple, Type, Union

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import Params, did_you_mean, load_yaml, split_params
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.lockstep.latency import LatencyParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.simulation.simulator import SimulatorParams

# The files by their stems, in the order of RobotParams.
CONFIG_FILES: Dict[str, Tuple[Type[Params], ...]] = {
    'config': (EncoderParams, OdometryParams),
    'simulator': (SimulatorParams,),
    'amcl': (AmclParams,),
    'navigation': (NavigatorParams,),
    'lockstep': (LatencyParams,),
}

# What a trial sets itself, and from where: an override of it would have no effect.
SET_BY_TRIALS = {
    'config.ppr': "the campaign's ppr",
    'config.ppr.left': "the campaign's ppr",
    'config.ppr.right': "the campaign's ppr",
    'amcl.initial_pose_x': "the test's start",
    'amcl.initial_pose_y': "the test's start",
    'amcl.initial_pose_a': "the test's start",
}

RobotConfig = Dict[str, Dict[str, Any]]


class RobotParams(NamedTuple):
    """The YAML files of config/, each as its nodes read it."""

    encoder: EncoderParams
    odometry: OdometryParams
    simulator: SimulatorParams
    amcl: AmclParams
    navigator: NavigatorParams
    latency: LatencyParams


def load_robot_params(config_folder: Union[str, Path]) -> RobotParams:
    """What trial.launch gives its nodes.

    Raises:
        ConfigError: a file is missing or bad.
    """
    folder, parts = Path(config_folder), []
    for stem, params_classes in CONFIG_FILES.items():
        path = folder / f'{stem}.yaml'
        parts += split_params(load_yaml(path), str(path), *params_classes)
    return RobotParams(*parts)


def load_robot_config(config_folder: Union[str, Path]) -> RobotConfig:
    """The files of config/ by their stems, as they are, but good.

    Raises:
        ConfigError: a file is missing or bad.
    """
    load_robot_params(config_folder)
    return {stem: load_yaml(Path(config_folder) / f'{stem}.yaml') for stem in CONFIG_FILES}


def override(config: RobotConfig, overrides: Mapping[str, Any]) -> RobotParams:
    """The parameters when some have other values.

    Args:
        config: from `load_robot_config`.
        overrides: values by dotted keys that begin with the stem of a file, such as
            `simulator.lidar.noise`; see `check_key`.

    Raises:
        ConfigError: a value is not allowed, or another key decides what this one should.
    """
    changed: RobotConfig = dict(config)
    for key, value in overrides.items():
        changed = _with_value(changed, key.split('.'), value)
    parts: List[Params] = []
    for stem, params_classes in CONFIG_FILES.items():
        parts += split_params(changed[stem], stem, *params_classes)
    params = RobotParams(*parts)
    for key, value in overrides.items():
        _check_it_took_effect(params, key, value)
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
        for stem, params_classes in CONFIG_FILES.items()
        for params_class in params_classes
        for name in _dotted_keys(params_class)
    ]
    if key not in known:
        hint = did_you_mean(key, known) or (
            '; allowed: a parameter of a file of config/, such as simulator.lidar.noise'
        )
        raise ConfigError(f'{key}: unknown key{hint}')


def _dotted_keys(params_class: Type[Params]) -> Iterator[str]:
    """Of single values; the flat names only, where costmaps know others as well."""
    for name, field in params_class.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Params):
            yield from (f'{name}.{below}' for below in _dotted_keys(field.annotation))
        else:
            yield name


def _with_value(mapping: Mapping[str, Any], path: Sequence[str], value: Any) -> Dict[str, Any]:
    first, *below = path
    if below:
        value = _with_value(mapping.get(first, {}), below, value)
    return {**mapping, first: value}


def _check_it_took_effect(params: RobotParams, key: str, value: Any) -> None:
    """move_base's namespaces overlap: what one sets, another can set again."""
    stem, *path = key.split('.')
    classes = CONFIG_FILES[stem]
    used: Any = next(part for part in params if isinstance(part, classes) and path[0] in type(part).model_fields)
    for name in path:
        used = getattr(used, name)
    if isinstance(used, (bool, int, float, str)) and used != value:
        raise ConfigError(f'{key}: given {value!r} has no effect: another key of config/{stem}.yaml makes it {used!r}')
