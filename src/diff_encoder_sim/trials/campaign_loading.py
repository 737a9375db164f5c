"""Reads a campaign file, checks it, and resolves it into cells."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Type, Union

from diff_encoder_sim.base.bounds import TRIALS
from diff_encoder_sim.base.errors import ConfigError, MissingLibrary
from diff_encoder_sim.base.imu import imu_settings
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.base.yaml_files import find_yaml, load_yaml
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.robots.robot_file import RobotNotFound
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.trials.campaign_cells import (
    Campaign,
    CampaignCell,
    CampaignParams,
    LockstepOptions,
    Varied,
    text_of,
)
from diff_encoder_sim.trials.robot_params import RobotParams, check_key, imu_of, load_robot, load_robot_config, override
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_files import collect
from diff_encoder_sim.trials.trials_csv import VARIANT
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, load_encoders, resolution_text

MOST_CELLS, MOST_TRIALS = 10_000, TRIALS.most  # reject a mistyped list before the memory is full
LONGEST_DRIVE_S = 86_400.0  # a day, as for the time limit of a route; rejects mistyped numbers
IMU, FUSION = 'imu', 'fusion'  # keys of a campaign, of its variants, and of `vary`
LONGEST_LABEL = 150  # leaves room for the trial number and the suffix of unfinished files


def load_campaign(
    name: str,
    package_folder: Union[str, Path],
    replace: Optional[Mapping[str, Any]] = None,
    robot_arguments: Optional[Mapping[str, str]] = None,
    robot_packages: Sequence[Path] = (),
    has_trials: bool = True,
) -> Campaign:
    """Load a campaign by its name (`paper` is config/campaigns/paper.yaml) or its file's path.

    Values of `replace`, from the command line, override the file's unless None: `files` are merged with the file's, and
    `ppr` or `encoders` replace both of the file's. Their paths are relative to the current folder, those in the file to
    it. If the campaign is navigated and `has_trials`, the robot needs a laser, and its tests a route. ConfigError if a
    file is missing or bad, or a value is not allowed.
    """
    config_folder, worlds = Path(package_folder, 'config'), Path(package_folder, 'worlds')
    path = find_yaml('campaign', name, config_folder / 'campaigns')
    given = {key: value for key, value in (replace or {}).items() if value is not None}
    params = _campaign_params(path, given)
    on_command_line = {*given, *(f'files.{stem}' for stem in given.get('files', {}))}

    @contextlib.contextmanager
    def source(*keys: str, errors: Type[ConfigError] = ConfigError) -> Iterator[Path]:
        """Yield the folder of relative paths; errors name the campaign's file unless the command line gives a key."""
        is_given = not on_command_line.isdisjoint(keys)
        try:
            yield Path() if is_given else path.parent
        except errors as error:
            raise error if is_given or isinstance(error, MissingLibrary) else ConfigError(f'{path}: {error}') from None

    config_files: Dict[str, Path] = {}
    for stem, file in params.files.items():
        key = f'files.{stem}'
        with source(key) as folder:
            config_files[stem] = find_yaml(key, file, config_folder, folder, stems=f'{stem}*')
    config = load_robot_config(config_folder, config_files)
    with source('robot', errors=RobotNotFound) as folder:  # other errors name the robot file
        robot = load_robot(params.robot, folder, Path(package_folder), robot_arguments or {}, robot_packages)
    if 'simulator.laser_link' not in params.overrides:
        if has_trials and params.nav != 'scripted':
            robot.check_laser()
        robot = robot.with_laser()
    with source('tests') as folder:
        tests = [load_test(test, config_folder, folder) for test in params.tests]
        _check_unique('tests', [test.name for test in tests])
        for test in tests if has_trials else ():
            test.check_drivable(params.nav)
    with source('ppr', 'encoders') as folder:
        encoders = _load_encoders(params, folder, config_folder)
    with source(IMU) as folder:
        named = [params.imu, *params.vary.get(IMU, ()), *(values.get(IMU, '') for values in params.variants.values())]
        imus = {str(name): imu_settings(str(name), config_folder, folder) for name in named}
    with source():
        count = len(tests) * len(encoders) * math.prod(map(len, params.varied_values.values()))
        if count > MOST_CELLS or count * params.trials > MOST_TRIALS:
            most = f'at most {MOST_CELLS} cells, {MOST_TRIALS} trials'
            raise ConfigError(f'given {count} cells of {params.trials} trials; allowed: {most}')
        combinations = _combinations(params, config, robot.settings, encoders, imus)
        trial_files = collect(tests, worlds, robot.file.source, needs_maps=params.nav != 'scripted')
        # Parameters that name parts of the robot file are checked by a simulator.
        simulators = [resolved[0].simulator for _, resolved in combinations]
        for each in {(s.left_joint, s.right_joint, s.laser_link, s.wheel_errors): s for s in simulators}.values():
            Simulator(find_world(tests[0].world, worlds), robot.file.source, each, IDENTITY, seed=0).close()
    for each in simulators:
        tests = [as_driven_by(each, test) for test in tests]
    cells = [
        CampaignCell(_label(test, encoder, varied), test, encoder, varied, robot_params)
        for test in tests
        for varied, resolved in combinations
        for encoder, robot_params in zip(encoders, resolved)
    ]
    if len({cell.label.casefold() for cell in cells}) < len(cells):  # some file systems ignore case
        cells = [cell._replace(label=f'{cell.label}_c{index}') for index, cell in enumerate(cells)]
    return Campaign(params, tests, encoders, cells, trial_files, robot)


def _campaign_params(path: Path, given: Mapping[str, Any]) -> CampaignParams:
    content = load_yaml(path)
    params = CampaignParams.from_mapping(content, str(path))
    if given:
        if 'ppr' in given or 'encoders' in given:
            content = {key: value for key, value in content.items() if key not in ('ppr', 'encoders')}
        files = {**params.files, **given.get('files', {})}
        params = CampaignParams.from_mapping({**content, **given, 'files': files}, '')
    return params


def campaign_encoders(name: str, config_folder: Path, replace: Mapping[str, Any]) -> Tuple[List[ChosenEncoder], int]:
    """Return the encoders and the seed of a campaign, without its robot and tests; arguments as of `load_campaign`."""
    path = find_yaml('campaign', name, config_folder / 'campaigns')
    given = {key: value for key, value in replace.items() if value is not None}
    params = _campaign_params(path, given)
    return _load_encoders(params, Path() if given else path.parent, config_folder), params.seed


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


def _combinations(
    params: CampaignParams,
    config: Mapping[str, Any],
    of_robot: Mapping[str, Any],
    encoders: Sequence[ChosenEncoder],
    imus: Mapping[str, Mapping[str, Any]],
) -> List[Tuple[Varied, List[RobotParams]]]:
    """Return each combination of varied parameters, and all parameters with each encoder.

    The campaign's values override the encoder's and those of an IMU of `imus`, by name; these the robot's, and these
    the files of config/.
    """
    for key in params.vary.keys() - {IMU, FUSION}:
        check_key(key)
    for name, values in (('', params.overrides), *params.variants.items()):
        where = name and f'variants: {name}: '
        for key in values:
            if not (name and key in (IMU, FUSION)):
                check_key(key, where)
            if key in params.vary:
                given = f'given under {"variants" if name else "set"} and vary'
                raise ConfigError(f'{where}{key}: {given}; allowed: one of them')
    combinations = []
    for combination in itertools.product(*params.varied_values.values()):
        varied, resolved = tuple(zip(params.varied_values, combination)), []
        values = {**params.overrides, **dict(varied)}
        values.update(params.variants.get(values.pop(VARIANT, ''), {}))
        fusion = LockstepOptions.from_mapping({FUSION: params.value_of(FUSION, varied)}, '').fusion
        imu = imus[str(params.value_of(IMU, varied))]
        values = {key: value for key, value in values.items() if key not in (IMU, FUSION)}
        for encoder in encoders:
            # The encoder of the robot file is replaced.
            below = {key: value for key, value in of_robot.items() if key not in RESOLUTION_KEYS}
            robot = override(config, {**below, **encoder.overrides, **imu, **values})
            imu_of(robot, fusion)
            if robot.encoder.encoder.counts_per_wheel_turn != (encoder.real and encoder.ppr.left):
                counts = resolution_text(robot.encoder.encoder) or 'no resolution'
                other = f'{"encoders" if encoder.real else "ppr"}: {encoder.label}'
                raise ConfigError(f'config.encoder: given {counts} and {other}; allowed: one of them')
            resolved.append(robot)
        # Encoders on other joints would fail after one second.
        turned = resolved[0].simulator.left_joint, resolved[0].simulator.right_joint
        for key in ('left_joint', 'right_joint'):
            joint = getattr(resolved[0].encoder, key)
            if joint not in turned:
                allowed = f'a joint of simulator.left_joint and simulator.right_joint: {" or ".join(turned)}'
                raise ConfigError(f'config.{key}: given {joint!r}; allowed: {allowed}')
        combinations.append((varied, resolved))
    # After the check of parameters, which rejects YAML values without a text, such as sets.
    for key, values_of_key in params.vary.items():
        _check_unique(key, [text_of(value) for value in values_of_key])
    return combinations


def as_driven_by(robot: SimulatorParams, test: TestDefinition) -> TestDefinition:
    """Return the test with limits of the motors, and pivots on a wheel as arcs; ConfigError above LONGEST_DRIVE_S."""
    drive = robot.drive
    allowed = {
        'speed': drive.max_linear_speed,
        'acceleration': drive.max_linear_acceleration,
        'angular_speed': drive.max_angular_speed,
        'angular_acceleration': drive.max_angular_acceleration,
    }
    # A drive without feedback above these limits would end short of its goal.
    slower = {key: limit for key, limit in allowed.items() if limit < getattr(test.limits, key)}
    paced = test.model_copy(update={'limits': test.limits.model_copy(update=slower)}) if slower else test
    if any(segment.pivot for segment in paced.drive):
        segments = [segment.on_wheels(robot.wheel_separation) for segment in paced.drive]
        paced = paced.model_copy(update={'drive': segments})
    duration_s = ScriptedDrive(paced).duration_s
    if duration_s > LONGEST_DRIVE_S:
        given = f'its drive takes {duration_s:.0f} s with the limits of test and robot'
        raise ConfigError(f'test {test.name}: {given}; allowed: up to {LONGEST_DRIVE_S:.0f} s')
    return paced


def _label(test: TestDefinition, encoder: ChosenEncoder, varied: Varied) -> str:
    named = [text_of(value) if key == VARIANT else key.rpartition('.')[2] + text_of(value) for key, value in varied]
    parts = [test.name, encoder.label, *named]
    return '_'.join(re.sub(r'[^A-Za-z0-9.+-]+', '_', part) for part in parts)[:LONGEST_LABEL]
