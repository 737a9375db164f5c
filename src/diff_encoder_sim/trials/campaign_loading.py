"""Reads a campaign file, checks it, and resolves it into cells."""

from __future__ import annotations

import contextlib
import functools
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.bounds import TRIALS
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.robots.robot_file import RobotNotFound
from diff_encoder_sim.simulation.simulator import DriveParams, Simulator
from diff_encoder_sim.trials.campaign_cells import Campaign, CampaignCell, CampaignParams, Varied, text_of
from diff_encoder_sim.trials.robot_params import (
    RobotConfig,
    RobotParams,
    check_key,
    load_robot,
    load_robot_config,
    override,
)
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_files import collect
from diff_encoder_sim.trials.trials_csv import VARIANT
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, load_encoders, resolution_text

# Limits that reject a mistyped list before the memory is full.
MOST_CELLS, MOST_TRIALS = 10_000, TRIALS.most
# A day, as for the time limit of a route; rejects mistyped numbers.
LONGEST_DRIVE_S = 86_400.0
# Leaves room for the trial number and the suffix of unfinished files.
LONGEST_LABEL = 150

# Values of the varied parameters, and all parameters with each encoder.
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
        package_folder: contains config/, worlds/ and urdf/.
        replace: values from the command line that override the file's; None: not given. `files` are merged with the
            file's; `ppr` or `encoders` replace both of the file's.
        robot_arguments: of the robot's xacro.
        robot_packages: folders that are searched for the robot's packages.
        has_trials: whether closed-loop trials, which need a laser, are run, unless the campaign is scripted.

    Raises:
        ConfigError: a file is missing or bad, or a value is not allowed.
    """
    package_folder = Path(package_folder)
    config_folder, worlds = package_folder / 'config', package_folder / 'worlds'
    path = _find(name, config_folder / 'campaigns')
    given = {key: value for key, value in (replace or {}).items() if value is not None}

    def origin(*keys: str) -> Optional[Path]:
        """Return the file that errors name and to which paths are relative; None if the command line gives a key."""
        return None if given.keys() & {*keys} else path

    params = _load_params(path, given)
    files = {stem: None if stem in given.get('files', {}) else path for stem in params.files}
    config = load_robot_config(config_folder, _config_files(params, files, config_folder))
    try:
        folder = _folder(origin('robot'))
        robot = load_robot(params.robot, folder, package_folder, robot_arguments or {}, robot_packages)
    except RobotNotFound as error:  # other errors name the robot file
        raise _named_error(origin('robot'), error) from None
    if 'simulator.laser_link' not in params.overrides:
        if has_trials and params.nav != 'scripted':
            robot.check_laser()
        robot = robot.with_laser()
    with _named(origin('tests')):
        tests = _load_tests(params, _folder(origin('tests')), config_folder)
    with _named(origin('ppr', 'encoders')):
        encoders = _load_encoders(params, _folder(origin('ppr', 'encoders')), config_folder)
    with _named(path):
        count = len(tests) * len(encoders) * params.combination_count()
        if count > MOST_CELLS or count * params.trials > MOST_TRIALS:
            most = f'at most {MOST_CELLS} cells, {MOST_TRIALS} trials'
            raise ConfigError(f'given {count} cells of {params.trials} trials; allowed: {most}')
        combinations = _resolve(params, config, robot.settings, encoders)
        trial_files = collect(tests, worlds, robot.file.source, needs_maps=params.nav != 'scripted')
        # Parameters that name parts of the robot file are checked by a simulator.
        simulators = [of_encoders[0].simulator for _, of_encoders in combinations]
        for each in {(s.left_joint, s.right_joint, s.laser_link, s.wheel_errors): s for s in simulators}.values():
            Simulator(find_world(tests[0].world, worlds), robot.file.source, each, IDENTITY, seed=0).close()
    return Campaign(params, _cells(tests, encoders, combinations), trial_files, robot)


@contextlib.contextmanager
def _named(source: Optional[Path]) -> Iterator[None]:
    """Prefix errors with the campaign's file, if given."""
    try:
        yield
    except ConfigError as error:
        raise _named_error(source, error) from None


def _named_error(source: Union[str, Path, None], error: ConfigError) -> ConfigError:
    return ConfigError(f'{source}: {error}' if source else str(error))


def _folder(source: Optional[Path]) -> Path:
    return source.parent if source else Path()


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


def _config_files(
    params: CampaignParams, origins: Mapping[Any, Optional[Path]], config_folder: Path
) -> Dict[str, Path]:
    """Return the files that replace those of config/, by stem."""
    found: Dict[str, Path] = {}
    for stem, name in params.files.items():
        found[stem] = _folder(origins[stem]) / name if name.endswith('.yaml') else config_folder / f'{name}.yaml'
        if not found[stem].is_file():
            known = ', '.join(sorted(file.stem for file in config_folder.glob(f'{stem}*.yaml')))
            error = ConfigError(f'files.{stem}: given {name!r}; allowed: {known}, or a .yaml file')
            raise _named_error(origins[stem], error)
    return found


def _load_tests(params: CampaignParams, folder: Path, config_folder: Path) -> List[TestDefinition]:
    """Load the tests; files among them are relative to `folder`."""
    names = [str(folder / name) if name.endswith('.yaml') else name for name in params.tests]
    tests = [load_test(name, config_folder) for name in names]
    _check_unique('tests', [test.name for test in tests])
    for test in tests:
        test.check_drivable(params.nav)
    return tests


def _load_encoders(params: CampaignParams, folder: Path, config_folder: Path) -> List[ChosenEncoder]:
    """Return the ideal encoders, then the real ones; files among them are relative to `folder`."""
    if not params.ppr and not params.encoders:
        raise ConfigError('ppr: missing; allowed: ppr, encoders, or both')
    ideal = [ChosenEncoder(ppr) for ppr in params.ppr]
    real = load_encoders(params.encoders, config_folder, folder)
    _check_unique('ppr', [encoder.label for encoder in ideal])
    _check_unique('encoders', [encoder.label for encoder in real], 'once; of two files, rename one')
    return [*ideal, *real]


def _check_unique(key: str, texts: Sequence[str], allowed: str = 'once') -> None:
    for text in texts:
        if texts.count(text) > 1:
            raise ConfigError(f'{key}: given {text} {texts.count(text)} times; allowed: {allowed}')


def _resolve(
    params: CampaignParams, config: RobotConfig, of_robot: Mapping[str, Any], encoders: Sequence[ChosenEncoder]
) -> List[Combination]:
    """Return each combination of varied parameters with all parameters; the campaign's override the robot's."""
    for key in params.vary:
        check_key(key)
    for name, values in (('', params.overrides), *params.variants.items()):
        for key in values:
            try:
                check_key(key)
                if key in params.vary:
                    given = f'given under {"variants" if name else "set"} and vary'
                    raise ConfigError(f'{key}: {given}; allowed: one of them')
            except ConfigError as error:
                raise _named_error(name and f'variants: {name}', error) from None
    resolved = []
    for varied in params.combinations():
        values = params.values_of(varied)
        of_encoders = [_parameters(config, of_robot, encoder, values) for encoder in encoders]
        # Encoders on other joints would fail after one second.
        turned = of_encoders[0].simulator.left_joint, of_encoders[0].simulator.right_joint
        for key in ('left_joint', 'right_joint'):
            joint = getattr(of_encoders[0].encoder, key)
            if joint not in turned:
                allowed = f'a joint of simulator.left_joint and simulator.right_joint: {" or ".join(turned)}'
                raise ConfigError(f'config.{key}: given {joint!r}; allowed: {allowed}')
        resolved.append((varied, of_encoders))
    # After the check of parameters, which rejects YAML values without a text, such as sets.
    for key, values_of_key in params.vary.items():
        _check_unique(key, [text_of(value) for value in values_of_key])
    return resolved


def _parameters(
    config: RobotConfig, of_robot: Mapping[str, Any], encoder: ChosenEncoder, of_campaign: Mapping[str, Any]
) -> RobotParams:
    """Return all parameters: the files of config/, then by dotted keys of the robot, the encoder and the campaign."""
    # The encoder of the robot file is replaced.
    values = {key: value for key, value in of_robot.items() if key not in RESOLUTION_KEYS}
    params = override(config, {**values, **encoder.overrides, **of_campaign})
    if params.encoder.encoder.counts_per_wheel_turn != (encoder.real and encoder.ppr.left):
        given = resolution_text(params.encoder.encoder) or 'no resolution'
        beside = f'encoders: {encoder.label}' if encoder.real else f'ppr: {encoder.label}'
        raise ConfigError(f'config.encoder: given {given} and {beside}; allowed: one of them')
    return params


def at_pace_of(drive: DriveParams, test: TestDefinition) -> TestDefinition:
    """Return the test with limits that the robot's motors allow.

    A drive without feedback above these limits would end short of its goal.

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
        given = f'its drive takes {duration_s:.0f} s with the limits of test and robot'
        raise ConfigError(f'test {test.name}: {given}; allowed: up to {LONGEST_DRIVE_S:.0f} s')
    return paced


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
    # Some file systems ignore case.
    if len({cell.label.casefold() for cell in cells}) < len(cells):
        cells = [cell._replace(label=f'{cell.label}_c{index}') for index, cell in enumerate(cells)]
    return cells


def _label(test: TestDefinition, encoder: ChosenEncoder, varied: Varied) -> str:
    named = [text_of(value) if key == VARIANT else key.rpartition('.')[2] + text_of(value) for key, value in varied]
    parts = [test.name, encoder.label, *named]
    return '_'.join(re.sub(r'[^A-Za-z0-9.+-]+', '_', part) for part in parts)[:LONGEST_LABEL]
