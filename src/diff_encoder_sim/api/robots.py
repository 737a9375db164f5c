"""Robots: their files, self-checks, and the node parameters derived from them."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from tabulate import tabulate

from diff_encoder_sim.api.options import DescriptionOptions, InspectOptions, LaunchOptions, SettingsOptions
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import NO_IMU, imu_settings
from diff_encoder_sim.base.package_files import package_folder, users_path
from diff_encoder_sim.base.params import flat, for_xml_rpc, nested, split_params
from diff_encoder_sim.base.yaml_files import load_yaml, yaml_value
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.robots import robot_file
from diff_encoder_sim.robots.xacro_expansion import expansion, xacro_arguments, xacro_arguments_of_text
from diff_encoder_sim.simulation.link_frames import display_urdf, without_root_inertia
from diff_encoder_sim.simulation.self_check import checks_table
from diff_encoder_sim.trials import robot_params
from diff_encoder_sim.trials.campaign_cells import check_robot
from diff_encoder_sim.trials.robot_params import CONFIG_FILES, RobotParams, load_robot
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, load_encoder, own_encoder
from diff_encoder_sim.wheels.diagnostics import hidden_encoder
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams

OWN_PPR, OWN_NOISE = 'config.ppr', 'config.motion_noise'
SIMULATED = 'pybullet'  # simulator with the wheel errors of the parameters
_ABSENT = object()
FILES = ('config', 'simulator', 'amcl', 'navigation', 'slam', 'fusion')
COSTMAPS = ('global_costmap', 'local_costmap')


class LaunchedRobot(NamedTuple):
    """Robot with the parameters of its nodes."""

    setup: robot_file.RobotSetup
    settings: Dict[str, Any]  # by dotted keys; override the YAML files
    params: RobotParams
    encoder: ChosenEncoder  # given by encoder:= or by the parameters
    notes: List[str]  # YAML values that override the robot, and defaults that hide the encoder


def launched_robot(
    options: LaunchOptions, arguments: Mapping[str, Any], usual: Optional[Mapping[str, Any]] = None
) -> LaunchedRobot:
    """Return the robot of launch options, and of `arguments` by dotted keys; ConfigError if one is invalid.

    Values of `usual`, by dotted keys, override only the package's files.
    """
    config, users_folder = package_folder() / 'config', _users_folder()
    given_files = {stem: getattr(options, 'config' if stem == 'config' else f'{stem}_config') for stem in FILES}
    files = {stem: given_files[stem] or str(config / f'{stem}.yaml') for stem in FILES}
    theirs = _users_values(files)
    xacro_values = xacro_arguments_of_text(options.robot_args)
    setup, encoder = load_robot(options.robot, users_folder, package_folder(), xacro_values), None
    if options.encoder:
        if OWN_PPR in arguments:
            raise ConfigError(f'encoder: given {options.encoder} with ppr {arguments[OWN_PPR]}; allowed: one of them')
        encoder = load_encoder(options.encoder, config, users_folder)
    if options.imu not in ('', NO_IMU) and options.sim not in ('', SIMULATED):
        raise ConfigError(f'imu: given {options.imu} with sim {options.sim}; allowed: with {SIMULATED}')
    settings = {**(usual or {}), **_config(robot_params.uncertainty_of_robot(setup.settings)), **setup.settings}
    if setup.file.ppr is not None:
        settings[OWN_PPR] = setup.file.ppr
    is_noise_given = any(OWN_NOISE in values for values in (settings, theirs, arguments))
    if options.sim != SIMULATED:  # other simulators have unknown wheel errors
        settings = {**_config(OdometryParams().uncertainty), **settings}
    replaced = {key for key in settings if any(_overlap(key, other) for other in theirs)}
    notes = [
        f'{key}: using {files[key.partition(".")[0]]}, not {settings[key]!r} of {setup.file.where}'
        for key in sorted(replaced & {*setup.file.overrides, OWN_PPR})
    ]
    # The parameter server does not support None.
    of_encoder = {key: value for key, value in encoder.overrides.items() if value is not None} if encoder else {}
    given = {**of_encoder, **imu_settings(options.imu, config, users_folder), **arguments}
    if options.fusion != 'none':
        given['config.publish_tf'] = False  # by the fusion
    if OWN_PPR in given:
        replaced.update(RESOLUTION_KEYS)  # overrides the robot's own encoder
    settings = {key: value for key, value in settings.items() if key not in replaced}
    # The package's costmaps that are missing in the user's file.
    costmaps, navigation = load_yaml(config / 'navigation.yaml'), load_yaml(files['navigation'])
    missing = {name: costmaps[name] for name in COSTMAPS if name not in navigation}
    settings = {**dict(flat({'navigation': missing})), **settings, **given}
    values = {stem: load_yaml(files.get(stem, config / f'{stem}.yaml')) for stem in CONFIG_FILES}
    for stem, classes in CONFIG_FILES.items():
        split_params(values[stem], files.get(stem, stem), *classes.values())  # separately, for errors of this file
    params = robot_params.override(values, settings)
    resolution = own_encoder(params.encoder).resolution
    if OWN_PPR in given and encoder is None and resolution:
        file = files['config']
        raise ConfigError(f'{file}: encoder: given {resolution} with ppr {given[OWN_PPR]}; allowed: one of them')
    settings.update(_config(params.odometry.uncertainty))
    imu = robot_params.imu_of(params, options.fusion)
    if imu is not None:
        frames = {'odom_frame': params.odometry.odom_frame, 'base_link_frame': params.odometry.base_frame}
        of_fusion = {**frames, 'publish_tf': True, 'imu': imu.model_dump()}
        settings.update((f'fusion.{key}', value) for key, value in flat(of_fusion))
    if options.sim != SIMULATED and not is_noise_given:
        notes += filter(None, [hidden_encoder(params.odometry)])
    return LaunchedRobot(setup, settings, params, encoder or own_encoder(params.encoder), notes)


def _config(values: Mapping[str, Any]) -> Dict[str, Any]:
    return {f'config.{key}': value for key, value in values.items()}


def _users_folder() -> Path:
    """Return the working directory of roslaunch, which runs its commands in a different one."""
    return Path(os.environ.get('PWD', '.'))


def _users_values(files: Mapping[str, str]) -> Dict[str, Any]:
    """Return the values of the user's files that differ from those of the package, by dotted keys."""
    values: Dict[str, Any] = {}
    for stem, path in files.items():
        own = package_folder() / 'config' / f'{stem}.yaml'
        if Path(path).resolve() != own.resolve():
            usual = dict(flat(load_yaml(own)))
            given = flat(load_yaml(path))
            values.update({f'{stem}.{key}': value for key, value in given if usual.get(key, _ABSENT) != value})
    return values


def _overlap(key: str, other: str) -> bool:
    """Return whether two dotted keys are equal, or one is a prefix of the other."""
    return f'{key}.'.startswith(f'{other}.') or f'{other}.'.startswith(f'{key}.')


def robot_urdf(options: DescriptionOptions) -> str:
    """Return the URDF of a robot; ConfigError if the robot cannot be read."""
    of_xacro = {**xacro_arguments_of_text(options.robot_args), **xacro_arguments(options.arguments, 'argument')}
    file = robot_file.load_robot_file(options.robot, _users_folder(), package_folder(), of_xacro)
    if options.frames:
        description = robot_file.set_up_robot(file).description
        return display_urdf(file.source, (description.left.joint, description.right.joint))
    return expansion(without_root_inertia(file.source) if options.no_root_inertia else file.source).urdf


def inspect_robot(options: InspectOptions, show: Callable[[str], None]) -> None:
    """Show the detected values of a robot with their sources, and the result of its self-check on a flat floor.

    ConfigError if it cannot be read, is not a differential drive, or fails a check; or if the file cannot be written.
    """
    write = options.write
    if write and write.exists():
        raise ConfigError(f'--write: {write} exists; allowed: the path of a new file')
    suffixes = robot_file.ROBOT_FILE_SUFFIXES
    if write and write.suffix not in suffixes:
        raise ConfigError(f'--write: given {write}; allowed: a name that ends in {" or ".join(suffixes)}')
    setup = load_robot(options.robot, Path(), package_folder(), xacro_arguments(options.robot_args), options.packages)
    description, where = setup.description, setup.file.where
    widths = [None, 52, 44]  # for common terminals
    show(tabulate(description.found, ['found', 'value', 'source'], disable_numparse=True, maxcolwidths=widths))
    if setup.file.overrides:
        show(f'\n{tabulate(list(setup.file.overrides.items()), [f"set in {where}", "value"], disable_numparse=True)}')
    for title, lines in (('Warnings', description.warnings), ('Notes', description.notes)):
        if lines:
            show('\n'.join([f'\n{title}:', *(f'- {line}' for line in lines)]))
    if write:
        try:
            write.parent.mkdir(parents=True, exist_ok=True)
            write.write_text(robot_file.robot_file_text(setup, write), encoding='utf-8')
        except OSError as error:
            raise ConfigError(f'--write: {write} cannot be written: {error.strerror}') from None
        show(f'\nWritten: {write}')
    usual = robot_params.load_robot_config(package_folder() / 'config')
    params = robot_params.override(usual, setup.settings).simulator
    if description.laser is None:
        params = params.model_copy(update={'laser_link': ''})  # the default link does not exist
    checks = check_robot(setup.file.source, params)
    show(f'\n{checks_table(checks)}\n')
    failed = [check.name for check in checks if not check.is_ok]
    if failed:
        raise ConfigError(f'{where}: the robot fails its self-check: {", ".join(failed)}')
    show(f'{setup.name}: all checks are ok.')


def node_settings(options: SettingsOptions) -> Tuple[Dict[str, Any], List[str]]:
    """Return the node parameters of a robot for /robot_settings, and notes; ConfigError if a file or a value is bad."""
    robot = launched_robot(options, launch_arguments(options.values), _of_bag(options.bag) if options.bag else {})
    model, base_frame = {'model': robot.setup.name}, {'base_frame': robot.params.odometry.base_frame}
    # Nodes without a file in config/.
    others = {'slam': base_frame, 'world_pose': model, 'ideal_odom': {**model, **base_frame}, 'global_pose': base_frame}
    return {**for_xml_rpc(nested(robot.settings)), **others}, robot.notes


def _of_bag(given: str) -> Dict[str, Any]:
    """Return the seed and the wheel uncertainty of a bag's trial, as in `reencode`."""
    trial = None
    with contextlib.suppress(ConfigError):  # replay_node reports the error
        trial = trial_of_source(open_source(users_path(given)))
    if trial is None:
        return {}
    return {'config.seed': trial.number, **{f'config.{key}': getattr(trial, key) for key in UNCERTAINTY_KEYS}}


def launch_arguments(words: Sequence[str]) -> Dict[str, Any]:
    """Parse FILE.KEY:=VALUE with YAML values, without empty ones; ConfigError if a word has a different form."""
    values = {}
    for word in words:
        key, separator, text = word.partition(':=')
        if not (key and separator):
            raise ConfigError(f'arguments: given {word!r}; allowed: FILE.KEY:=VALUE')
        if key not in (OWN_PPR, 'config.seed'):  # which launch arguments set
            robot_params.check_key(key)
        if text:
            values[key] = yaml_value(text, key)
    return values
