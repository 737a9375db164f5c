"""Parameters of all parts of a robot, from the YAML files of config/."""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any, Dict, Iterator, Mapping, NamedTuple, Optional, Sequence, Tuple, Type, Union

from pydantic import Field, field_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.params import Params, did_you_mean, field_struct, merged, nested, split_params, with_changes
from diff_encoder_sim.base.per_wheel import PerWheel, WheelDiameter
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.fusion import FusionParams
from diff_encoder_sim.navigation.goal_stopping import StopSpread, stop_parts, stop_spread
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.robots.robot_file import RobotFile, RobotSetup, load_robot_file, set_up_robot
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.simulation.slip import CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, WheelErrorParams
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S
from diff_encoder_sim.wheels.encoder_params import ppr_label
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

Latency_s = Annotated[float, Between(0.0, 10.0, 's')]


class LatencyParams(Params):
    """Simulated latency from the input of a part to the arrival of its output."""

    odometry: Latency_s = Field(0.0, description='from wheel angles to /odom [s]')
    localization: Latency_s = Field(0.0, description='from /odom and /scan to map->odom [s]')
    command: Latency_s = Field(0.02, description='from /odom to the wheels; 0.02 as in the live graph [s]')

    @field_validator('*')
    @classmethod
    def _check_ticks(cls, value: float) -> float:
        if abs(value / TICK_S - round(value / TICK_S)) > 1e-6:
            raise ValueError(f'whole {TICK_NS // 1_000_000} ms')
        return value


def latency_ns(latency_s: float) -> int:
    """Return a latency in nanoseconds."""
    return round(latency_s * NANOSECONDS_PER_SECOND)


def wheel_uncertainty(errors: WheelErrorParams) -> Dict[str, float]:
    """Return the parameters of odometry, by their names, that describe the errors of wheels."""
    # Relative excess of the travel of each wheel over its rolled angle times the nominal radius.
    wheels = (errors.left_radius_error, errors.left_slip), (errors.right_radius_error, errors.right_slip)
    left, right = (radius - slip * (1.0 + radius) for radius, slip in wheels)
    distance, spread = 0.5 * (left + right), errors.radius_spread / math.sqrt(2.0)
    separation = math.hypot(spread, errors.wheel_separation_spread)
    return {
        'motion_noise': errors.travel_variance,
        'distance_std': math.hypot(distance, spread),
        'turn_std': math.hypot(distance - errors.wheel_separation_error, separation),
        'diameter_difference_std': math.hypot(right - left, 2.0 * spread),
    }


def wheel_errors_of(settings: Mapping[str, Any]) -> WheelErrorParams:
    """Return the wheel errors of a robot's settings, by dotted keys; ConfigError if one is bad."""
    given = nested(settings).get('simulator', {}).get('wheel_errors', {})
    return WheelErrorParams.from_mapping(given, 'simulator.wheel_errors')


def uncertainty_of_robot(settings: Mapping[str, Any]) -> Dict[str, float]:
    """Return the parameters of odometry by the wheel errors of a robot's settings; 0 counts as not specified."""
    return {key: value for key, value in wheel_uncertainty(wheel_errors_of(settings)).items() if value}


CONFIG_FILES: Dict[str, Dict[str, Type[Params]]] = {  # by stem of the file, the fields of RobotParams that it sets
    'config': {'encoder': EncoderParams, 'odometry': OdometryParams},
    'simulator': {'simulator': SimulatorParams},
    'amcl': {'amcl': AmclParams},
    'navigation': {'navigator': NavigatorParams},
    'lockstep': {'latency': LatencyParams},
    'fusion': {'fusion': FusionParams},
}

SET_BY_TRIALS = {  # keys set by the trial, with their source; overrides would have no effect
    **dict.fromkeys(('config.ppr', 'config.ppr.left', 'config.ppr.right'), "the campaign's ppr"),
    'config.seed': "the trial's number",
    **dict.fromkeys(('amcl.initial_pose_x', 'amcl.initial_pose_y', 'amcl.initial_pose_a'), "the test's start"),
}

RobotConfig = Dict[str, Dict[str, Any]]


class RobotParams(NamedTuple):
    """Parameters of each part, as its node reads them; odometry includes the simulated wheel errors."""

    encoder: EncoderParams
    odometry: OdometryParams
    simulator: SimulatorParams
    amcl: AmclParams
    navigator: NavigatorParams
    latency: LatencyParams
    fusion: FusionParams


def load_robot_config(config_folder: Union[str, Path], instead: Optional[Mapping[str, Path]] = None) -> RobotConfig:
    """Load the files by their stems, for `override`; those of `instead` replace them; ConfigError if one is bad."""
    paths = {**{stem: Path(config_folder, f'{stem}.yaml') for stem in CONFIG_FILES}, **(instead or {})}
    config = {stem: load_yaml(path) for stem, path in paths.items()}
    _robot_params(config, paths)
    return config


def override(config: Mapping[str, Any], overrides: Mapping[str, Any]) -> RobotParams:
    """Return the parameters with values by dotted keys, see `check_key`; ConfigError if one is bad or has no effect."""
    params = _robot_params(merged(config, nested(overrides)), {})
    for key, value in overrides.items():
        stem, *path = key.split('.')  # in move_base's overlapping namespaces another key can set the same parameter
        parts = [getattr(params, field) for field in CONFIG_FILES[stem]]
        used = functools.reduce(getattr, path, next(part for part in parts if path[0] in type(part).model_fields))
        if isinstance(used, (bool, int, float, str)) and used != value:
            reason = f'another key of config/{stem}.yaml makes it {used!r}'
            raise ConfigError(f'{key}: given {value!r} has no effect: {reason}')
    return params


def _robot_params(config: Mapping[str, Any], paths: Mapping[str, Path]) -> RobotParams:
    """Check the content of all files; errors name a file by its path or, without one, by its stem."""
    parts: Dict[str, Any] = {}
    for stem, classes in CONFIG_FILES.items():
        parts.update(zip(classes, split_params(config[stem], str(paths.get(stem, stem)), *classes.values())))
    # Unset uncertainties of odometry are those of the simulated wheel errors and contact.
    values = {'curve_noise': CONTACT_CURVE_NOISE, **wheel_uncertainty(parts['simulator'].wheel_errors)}
    values['distance_std'] = math.hypot(values['distance_std'], CONTACT_DISTANCE_STD)
    unset = {key: value for key, value in values.items() if getattr(parts['odometry'], key) is None}
    if unset:
        parts['odometry'] = with_changes(parts['odometry'], unset, 'simulator.wheel_errors')
    return RobotParams(**parts)


def imu_of(params: RobotParams, fusion: str) -> Optional[ImuParams]:
    """Return the IMU, which fusion needs: ConfigError without one, unless fusion is `none`."""
    if params.simulator.imu is None and fusion != 'none':
        raise ConfigError(f'fusion: given {fusion} without an IMU; allowed: with an IMU, such as mpu6050, or none')
    return params.simulator.imu


def check_key(key: str, where: str = '') -> None:
    """Check that a dotted key, such as `simulator.lidar.noise`, exists and no trial sets it; `where` begins errors."""
    if key in SET_BY_TRIALS:
        raise ConfigError(f'{where}{key}: every trial sets it; allowed: {SET_BY_TRIALS[key]}')
    files = CONFIG_FILES.items()
    known = [name for stem, classes in files for each in classes.values() for name in _dotted_keys(each, f'{stem}.')]
    if key not in known:
        hint = did_you_mean(key, known) or '; allowed: a parameter of a file of config/, such as simulator.lidar.noise'
        raise ConfigError(f'{where}{key}: unknown key{hint}')


def _dotted_keys(params_class: Type[Params], prefix: str) -> Iterator[str]:
    """Yield the keys of scalars and diameters; for costmaps only the flat names, without their namespace aliases."""
    for name, field in params_class.model_fields.items():
        kind = field_struct(field.annotation)
        if kind is not None and not issubclass(kind, WheelDiameter):
            yield from _dotted_keys(kind, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}'


def load_numbers(
    given: str, folder: Path, package_folder: Path, arguments: Mapping[str, str], packages: Sequence[Path] = ()
) -> Tuple[RobotFile, Dict[str, Any]]:
    """Load a robot as `load_robot`, but without a URDF too; return its file and its settings by dotted keys."""
    file = load_robot_file(given or 'alto', folder, package_folder, arguments, packages)
    for key in file.overrides:
        check_key(key, f'{file.where}: set: ')
    settings = file.overrides if file.urdf is None else set_up_robot(file).settings
    try:
        override(load_robot_config(package_folder / 'config'), settings)
    except ConfigError as error:
        raise ConfigError(f'{file.where}: {error}') from None
    return file, settings


def load_robot(
    given: str, folder: Path, package_folder: Path, arguments: Mapping[str, str], packages: Sequence[Path] = ()
) -> RobotSetup:
    """Load a robot: name ('' for alto), robot file, xacro or URDF, relative to `folder`; ConfigError if one is bad."""
    return set_up_robot(load_numbers(given, folder, package_folder, arguments, packages)[0])


_ENDS = {'latch': 'ends anywhere within', 'precise': 'drives up to within about'}  # by `stop`


def spread_with(params: RobotParams, ppr: PerWheel) -> StopSpread:
    """Return the estimated distance from the goal at which the robot stops with an encoder."""
    return stop_spread(params.navigator.DWAPlannerROS, parts_with(params, ppr))


def parts_with(params: RobotParams, ppr: PerWheel) -> Dict[str, StopSpread]:
    """Return the distance of `spread_with` by its causes."""
    odometry, navigator = params.odometry, params.navigator
    diameter = odometry.wheel_diameter
    pulse_m = max(math.pi * diameter.left / ppr.left, math.pi * diameter.right / ppr.right)
    step = StopSpread(pulse_m, pulse_m / odometry.wheel_separation)
    return stop_parts(navigator.DWAPlannerROS, navigator.control_period_s, params.latency.command, step)


def stopping_line(params: RobotParams, pprs: Sequence[PerWheel]) -> str:
    """Describe how a robot stops with its encoders, and the requested tolerances."""

    def words(spread: StopSpread) -> str:
        return f'{1e3 * spread.position_m:.0f} mm and {math.degrees(spread.yaw_rad):.1f} degrees'

    planner = params.navigator.DWAPlannerROS
    spreads = sorted((spread_with(params, ppr), ppr_label(ppr)) for ppr in pprs)
    (least, finest), (most, coarsest) = spreads[0], spreads[-1]
    ends = f'{words(least)} of the goal'
    if least != most:
        ends = f'{ends} with {finest} counts, {words(most)} with {coarsest} counts'
    asked = StopSpread(planner.xy_goal_tolerance, planner.yaw_goal_tolerance)
    return f'stopping: {planner.stop} {_ENDS[planner.stop]} {ends}; asked for: {words(asked)}'


def as_upstream(params: RobotParams) -> RobotParams:
    """Return the parameters for upstream's move_base, without `stop` and `latch_margin`."""
    planner = params.navigator.DWAPlannerROS.model_copy(update={'stop': 'latch', 'latch_margin': 0.0})
    return params._replace(navigator=params.navigator.model_copy(update={'DWAPlannerROS': planner}))
