"""Reads a campaign file, checks all of it, and resolves it into cells."""

from __future__ import annotations

import contextlib
import functools
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import RobotNotFound
from diff_encoder_sim.robots.robot_setup import RobotSetup
from diff_encoder_sim.simulation.simulator import DriveParams, Simulator
from diff_encoder_sim.trials.campaign_cells import (
    MOST_CELLS,
    MOST_TRIALS,
    VARIANT,
    Campaign,
    CampaignCell,
    CampaignParams,
    Varied,
    campaign_robot,
    text_of,
)
from diff_encoder_sim.trials.robot_params import (
    RobotConfig,
    RobotParams,
    check_key,
    load_robot,
    load_robot_config,
    override,
)
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_files import TrialFiles, collect
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, chosen, load_encoders, resolution_text


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


# A day, as of the time limit of a route: a mistyped number must not drive for ever.
LONGEST_DRIVE_S = 86_400.0


def at_pace_of(drive: DriveParams, test: TestDefinition) -> TestDefinition:
    """Return the test with limits that the robot's motors allow.

    A drive without feedback that commands more would end short of its goal.

    Raises:
        ConfigError: the drive would take longer than LONGEST_DRIVE_S.
    """
    allowed = {
        'speed': drive.max_linear_speed,
        'acceleration': drive.max_linear_acceleration,
        'angular_speed': drive.max_angular_speed,
        'angular_acceleration': drive.max_angular_acceleration,
    }
    slower = {key: limit for key, limit in allowed.items() if limit < getattr(test.limits, key)}
    paced = test.model_copy(update={'limits': test.limits.model_copy(update=slower)}) if slower else test
    duration_s = ScriptedDrive(paced).duration_s
    if duration_s > LONGEST_DRIVE_S:
        raise ConfigError(
            f'test {test.name}: its drive takes {duration_s:.0f} s with the limits of test and robot; allowed: up to '
            f'{LONGEST_DRIVE_S:.0f} s'
        )
    return paced


# Leaves room for a trial's number and for the name that a file has while it is unfinished.
LONGEST_LABEL = 150

# Values of what is varied, and all parameters with each encoder.
Combination = Tuple[Varied, List[RobotParams]]


def load_campaign(
    name: str,
    package_folder: Union[str, Path],
    replace: Optional[Mapping[str, Any]] = None,
    robot_arguments: Optional[Mapping[str, str]] = None,
    robot_packages: Sequence[Path] = (),
    has_trials: bool = True,
) -> Campaign:
    """Load a campaign by its name (`paper` is config/campaigns/paper.yaml) or its file's path.

    Args:
        name: paths of tests and of the robot in a file are relative to that file; on the command
            line to the current folder.
        package_folder: where config/, worlds/ and urdf/ are.
        replace: values from the command line that come before the file's; None is none. Of `files`, only those that
            are named replace the file's; `ppr` or `encoders` replace both of the file's.
        robot_arguments: of the robot's xacro.
        robot_packages: folders in which the robot's packages are looked for.
        has_trials: closed-loop trials, which need a laser, are run, unless the campaign's are scripted.

    Raises:
        ConfigError: a file is missing or bad, or a value is not allowed.
    """
    package_folder = Path(package_folder)
    path = _find(name, package_folder / 'config' / 'campaigns')
    given = {key: value for key, value in (replace or {}).items() if value is not None}
    is_own_choice = 'ppr' in given or 'encoders' in given
    params = _load_params(path, given)
    config = load_robot_config(
        package_folder / 'config', _config_files(params, path, given.get('files', {}), package_folder / 'config')
    )
    campaigns_file = None if 'robot' in given else path
    robot = _load_robot(params, campaigns_file, package_folder, robot_arguments or {}, robot_packages)
    if 'simulator.laser_link' not in params.overrides:
        if has_trials and params.nav != 'scripted':
            robot.check_laser()
        robot = robot.with_laser()
    with _named('' if 'tests' in given else path):
        tests = _load_tests(params, None if 'tests' in given else path.parent, package_folder / 'config')
    with _named('' if is_own_choice else path):
        encoders = _load_encoders(params, Path() if is_own_choice else path.parent, package_folder / 'config')
    with _named(path):
        _check_size(params, len(encoders))
        combinations = _resolve(params, config, robot.settings, encoders)
        files = _collect(params, tests, combinations, robot.file.source, package_folder)
    return Campaign(params, _cells(tests, encoders, combinations), files, campaign_robot(robot))


def _find(name: str, folder: Path) -> Path:
    path = Path(name) if name.endswith('.yaml') else folder / f'{name}.yaml'
    if not path.is_file():
        known = ', '.join(sorted(file.stem for file in folder.glob('*.yaml')))
        raise ConfigError(f'campaign: given {name!r}; allowed: {known}, or a .yaml file')
    return path


def _load_params(path: Path, given: Mapping[str, Any]) -> CampaignParams:
    content = load_yaml(path)
    params = CampaignParams.from_mapping(content, str(path))
    if not given:
        return params
    files = {**params.files, **given.get('files', {})}
    if 'ppr' in given or 'encoders' in given:
        content = {key: value for key, value in content.items() if key not in ('ppr', 'encoders')}
    return CampaignParams.from_mapping({**content, **given, 'files': files}, '')


@contextlib.contextmanager
def _named(source: Union[str, Path]) -> Iterator[None]:
    """Put the campaign's file, or nothing, before what is wrong."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(f'{source}: {error}' if source else str(error)) from None


def _config_files(params: CampaignParams, path: Path, given: Mapping[str, str], config_folder: Path) -> Dict[str, Path]:
    """Find the files that are read in place of those of config/; `given` are from the command line."""
    found: Dict[str, Path] = {}
    for stem, name in params.files.items():
        with _named('' if stem in given else path):
            found[stem] = _config_file(stem, name, Path() if stem in given else path.parent, config_folder)
    return found


def _config_file(stem: str, name: str, folder: Path, config_folder: Path) -> Path:
    path = folder / name if name.endswith('.yaml') else config_folder / f'{name}.yaml'
    if not path.is_file():
        known = ', '.join(sorted(file.stem for file in config_folder.glob(f'{stem}*.yaml')))
        raise ConfigError(f'files.{stem}: given {name!r}; allowed: {known}, or a .yaml file')
    return path


def _load_tests(params: CampaignParams, folder: Optional[Path], config_folder: Path) -> List[TestDefinition]:
    """Load the tests; files among them are relative to `folder`, else to the current folder."""
    tests = [
        load_test(str(folder / name) if folder and name.endswith('.yaml') else name, config_folder)
        for name in params.tests
    ]
    _check_unique('tests', [test.name for test in tests])
    for test in tests:
        test.check_drivable(params.nav)
    return tests


def _load_robot(
    params: CampaignParams,
    path: Optional[Path],
    package_folder: Path,
    arguments: Mapping[str, str],
    packages: Sequence[Path],
) -> RobotSetup:
    """Load the robot, which the campaign's file names where its `path` is given; other errors are its own file's."""
    try:
        return load_robot(params.robot, path.parent if path else Path(), package_folder, arguments, packages)
    except RobotNotFound as error:
        raise ConfigError(f'{path}: {error}' if path else str(error)) from None


def _load_encoders(params: CampaignParams, folder: Path, config_folder: Path) -> List[ChosenEncoder]:
    """Return the ideal encoders, then the real ones; files among them are relative to `folder`."""
    if not params.ppr and not params.encoders:
        raise ConfigError('ppr: missing; allowed: ppr, encoders, or both')
    ideal = [ChosenEncoder(ppr) for ppr in params.ppr]
    real = [chosen(encoder) for encoder in load_encoders(params.encoders, config_folder, folder)]
    _check_unique('ppr', [encoder.label for encoder in ideal])
    _check_unique('encoders', [encoder.label for encoder in real], 'once; of two files, rename one')
    return [*ideal, *real]


def _check_size(params: CampaignParams, encoders: int) -> None:
    cells = len(params.tests) * encoders * params.combination_count()
    if cells > MOST_CELLS or cells * params.trials > MOST_TRIALS:
        raise ConfigError(
            f'given {cells} cells of {params.trials} trials; allowed: at most {MOST_CELLS} cells, {MOST_TRIALS} trials'
        )


def _resolve(
    params: CampaignParams, config: RobotConfig, of_robot: Mapping[str, Any], encoders: Sequence[ChosenEncoder]
) -> List[Combination]:
    """Return each combination of varied parameters with all parameters; the campaign's precede the robot's."""
    _check_keys(params)
    resolved = []
    for varied in params.combinations():
        values = params.values_of(varied)
        resolved.append((varied, [encoder_parameters(config, of_robot, encoder, values) for encoder in encoders]))
    # Not before: YAML has values, such as sets, that no parameter allows and no text can show.
    for key, values_of_key in params.vary.items():
        _check_unique(key, [text_of(value) for value in values_of_key])
    for _, of_encoders in resolved:
        _check_joints(of_encoders[0])
    return resolved


def _check_keys(params: CampaignParams) -> None:
    for key in (*params.overrides, *params.vary):
        check_key(key)
        if key in params.overrides and key in params.vary:
            raise ConfigError(f'{key}: given under set and vary; allowed: one of them')
    for name, values in params.variants.items():
        for key in values:
            with _named(f'variants: {name}'):
                check_key(key)
                if key in params.vary:
                    raise ConfigError(f'{key}: given under variants and vary; allowed: one of them')


def _check_joints(params: RobotParams) -> None:
    """Check that encoders are on driven joints: on another, each trial would fail after its first second."""
    turned = params.simulator.left_joint, params.simulator.right_joint
    for key in ('left_joint', 'right_joint'):
        joint = getattr(params.encoder, key)
        if joint not in turned:
            raise ConfigError(
                f'config.{key}: given {joint!r}; allowed: a joint of simulator.left_joint '
                f'and simulator.right_joint: {" or ".join(turned)}'
            )


def _collect(
    params: CampaignParams,
    tests: Sequence[TestDefinition],
    combinations: Sequence[Combination],
    robot: RobotSource,
    package_folder: Path,
) -> TrialFiles:
    """Read the files of the trials, and try each simulator once."""
    worlds = package_folder / 'worlds'
    files = collect(tests, worlds, robot, needs_maps=params.nav != 'scripted')
    simulators = [of_encoders[0].simulator for _, of_encoders in combinations]
    # What names parts of the robot file, or changes it, must find them there.
    differing = {
        (simulator.left_joint, simulator.right_joint, simulator.laser_link, simulator.wheel_errors): simulator
        for simulator in simulators
    }
    for simulator in differing.values():
        Simulator(find_world(tests[0].world, worlds), robot, simulator, IDENTITY, seed=0).close()
    return files


def _check_unique(key: str, texts: Sequence[str], allowed: str = 'once') -> None:
    for text in texts:
        if texts.count(text) > 1:
            raise ConfigError(f'{key}: given {text} {texts.count(text)} times; allowed: {allowed}')


def _cells(
    tests: Sequence[TestDefinition], encoders: Sequence[ChosenEncoder], combinations: Sequence[Combination]
) -> List[CampaignCell]:
    drives = [of_encoders[0].simulator.drive for _, of_encoders in combinations]
    paced = [functools.reduce(lambda slower, drive: at_pace_of(drive, slower), drives, test) for test in tests]
    cells = [
        CampaignCell(_label(test, encoder, varied), test, encoder, varied, robot_params)
        for test in paced
        for varied, of_encoders in combinations
        for encoder, robot_params in zip(encoders, of_encoders)
    ]
    # To some file systems SL_a and sl_A are the same name.
    if len({cell.label.casefold() for cell in cells}) < len(cells):
        cells = [cell._replace(label=f'{cell.label}_c{index}') for index, cell in enumerate(cells)]
    return cells


def _label(test: TestDefinition, encoder: ChosenEncoder, varied: Varied) -> str:
    named = [text_of(value) if key == VARIANT else key.rpartition('.')[2] + text_of(value) for key, value in varied]
    parts = [test.name, encoder.label, *named]
    return '_'.join(re.sub(r'[^A-Za-z0-9.+-]+', '_', part) for part in parts)[:LONGEST_LABEL]
