"""Loads what the user names: a campaign's folder (manifest.json, trials.csv and its bags), or bags of trials."""

from __future__ import annotations

import itertools
import json
import logging
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple, Union

from diff_encoder_sim.analysis.bag_dataset import BagTrial, bag_dataset, read_bag_trials, robot_of
from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry, TrialData
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.trials.campaign_cells import BAGS, VARIANT
from diff_encoder_sim.trials.results import MANIFEST, TABLE, TrialRow, csv_fields, header, row_of

# Of a trial: metres, radians or seconds. Squares of what is larger, or not finite, spoil every table.
LARGEST_NUMBER = 1e9


class Manifest(NamedTuple):
    """The content of manifest.json that the analysis uses."""

    content: Dict[str, Any]  # all of it
    name: str
    requested: Dict[str, Trial]  # the definition of one trial of each test
    robots: List[RobotGeometry]  # of each set of parameters
    varied_keys: List[str]
    trial_count: int  # of the whole campaign


class CampaignFolder(NamedTuple):
    """The results of a campaign, finished or not."""

    manifest: Manifest
    rows: List[TrialRow]
    notes: List[str]  # what is missing, a line each


def is_campaign(folder: Path) -> bool:
    """Return whether the folder has a campaign's results."""
    return (folder / MANIFEST).is_file()


def read_campaign(folder: Path) -> CampaignFolder:
    """Read a campaign's folder, but not its bags.

    Raises:
        ConfigError: a file is missing or is not as a campaign wrote it.
    """
    manifest = _manifest(folder / MANIFEST)
    rows, notes = _rows(folder / TABLE, manifest)
    missing = manifest.trial_count - len(rows)
    if missing > 0:
        notes.append(
            f'{folder / TABLE}: has {len(rows)} of {manifest.trial_count} trials; the '
            f'same campaign command runs the others'
        )
    return CampaignFolder(manifest, rows, notes)


def _manifest(path: Path) -> Manifest:
    try:
        content = json.loads(_text(path))
        configuration = content['configuration']
        requested = [_requested(test, configuration['nav'], path) for test in configuration['tests']]
        parameters = configuration['parameters']
        encoders = len(configuration['ppr']) + len(configuration.get('encoders', []))
        count = len(requested) * len(parameters) * encoders * configuration['trials']
        return Manifest(
            content,
            str(content['name']),
            {trial.test.name: trial for trial in requested},
            [_robot(each['odometry']) for each in parameters],
            sorted(parameters[0]['varied']),
            int(count),
        )
    except (KeyError, IndexError, TypeError, AttributeError, json.JSONDecodeError):
        raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it') from None


def _requested(test: Dict[str, Any], nav: str, path: Path) -> Trial:
    definition = {key: value for key, value in test.items() if key != 'files'}
    return Trial.from_mapping({'nav': nav, 'test': definition}, str(path))


def _robot(odometry: Dict[str, Any]) -> RobotGeometry:
    return RobotGeometry(float(odometry['wheel_diameter']), float(odometry['wheel_separation']))


def _rows(path: Path, manifest: Manifest) -> Tuple[List[TrialRow], List[str]]:
    """Return the trials, and a note where the last line is incomplete."""
    # A line is written in one call and its end comes last: what follows the last end is incomplete.
    *lines, torn = _text(path).split('\n')
    notes = [f'{path}: the last line is incomplete; its trial is left out'] if torn else []
    rows: Dict[Tuple[object, ...], TrialRow] = {}
    for number, line in enumerate(lines, start=1):
        try:
            if number == 1:
                _check(csv_fields(line.encode('utf-8')) == header(manifest.varied_keys))
            else:
                row = _row(line, manifest)
                _check(row.identity() not in rows)
                rows[row.identity()] = row
        except ValueError:
            raise ConfigError(
                f'{path}: line {number} does not belong to the campaign of {MANIFEST}, occurs twice or has a '
                f'number that no trial has; expected it as campaign wrote it'
            ) from None
    return list(rows.values()), notes


def _row(line: str, manifest: Manifest) -> TrialRow:
    """Parse a line of trials.csv.

    Raises:
        ValueError: it is not a trial of the campaign.
    """
    row = row_of(csv_fields(line.encode('utf-8')), manifest.varied_keys)
    errors = itertools.chain.from_iterable(error for error in row.errors.values() if error)
    numbers = (row.duration_s, row.distance_m, row.wall_time_s, *errors)
    _check(row.test in manifest.requested and all(abs(number) <= LARGEST_NUMBER for number in numbers))
    return row


def _check(is_valid: bool) -> None:
    if not is_valid:
        raise ValueError


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding='utf-8')
    except FileNotFoundError:
        raise ConfigError(f'{path}: no such file; expected a folder that campaign wrote, or bags') from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: cannot be read: {error}') from None


def campaign_dataset(folder: Path) -> Dataset:
    """Read a campaign's folder; some or all bags may be missing.

    Raises:
        ConfigError: no trial is finished, or a file is not as the campaign wrote it.
    """
    manifest, rows, notes = read_campaign(folder)
    if not rows:
        raise ConfigError(f'{folder}: no trial is finished; expected at least one')
    bags, missing = _bags_of_rows(folder, rows)
    notes = notes + missing
    trials = [data_of(row) for row in rows]
    for index, bag in zip(bags, read_bag_trials(list(bags.values()))):
        trials[index], problem = _with_paths(trials[index], bag, manifest)
        notes += problem
    return Dataset(manifest.name, trials, notes, manifest.content, folder, manifest.robots[0], manifest.requested)


def data_of(row: TrialRow) -> TrialData:
    """Convert a line of trials.csv; without its bag nothing is known about the path."""
    return TrialData(
        row.test,
        row.ppr,
        row.varied,
        row.trial,
        row.seed,
        row.outcome,
        row.reason,
        row.duration_s,
        row.distance_m,
        row.errors,
        {},
        None,
        None,
    )


def _bags_of_rows(folder: Path, rows: Sequence[TrialRow]) -> Tuple[Dict[int, Path], List[str]]:
    """Return the paths of the existing bags by the row's index, and notes of missing and foreign bags."""
    bags = {index: folder / row.bag for index, row in enumerate(rows) if row.bag and (folder / row.bag).is_file()}
    notes = []
    if len(bags) < len(rows):
        notes.append(
            f'{folder / BAGS}: has bags of {len(bags)} of {len(rows)} trials; the others have no errors along the path'
        )
    foreign = sorted(set(bags_in(folder / BAGS)) - set(bags.values()))
    if foreign:
        notes.append(f'{foreign[0]}: not a bag of trials.csv ({len(foreign)} such); left out')
    return bags, notes


def _with_paths(trial: TrialData, bag: Union[BagTrial, str], manifest: Manifest) -> Tuple[TrialData, List[str]]:
    """Add the errors along the path from the bag, or return a note why not."""
    if isinstance(bag, str):
        return trial, [bag]
    differing = _differences(trial, bag, manifest)
    if differing:
        return trial, [
            f'{bag.data.bag}: differs in {", ".join(differing)} from its line in trials.csv; expected the same trial'
        ]
    return trial._replace(paths=bag.data.paths, tracks=bag.data.tracks, bag=bag.data.bag), []


def _differences(trial: TrialData, bag: BagTrial, manifest: Manifest) -> List[str]:
    """Return the keys in which the bag's trial differs from the trial of trials.csv."""
    recorded, requested = bag.trial, manifest.requested[trial.test]
    expected = {'test': requested.test, 'number': trial.seed, 'nav': requested.nav}
    differing = [key for key, value in expected.items() if getattr(recorded, key) != value]
    if recorded.encoder_label != trial.ppr:
        differing.append('ppr')
    if recorded.variant != dict(trial.varied).get(VARIANT, ''):
        differing.append(VARIANT)
    if robot_of(recorded) not in manifest.robots:
        differing.append('wheel_diameter, wheel_separation')
    return differing


log = logging.getLogger(__name__)


def load_dataset(paths: Sequence[Path]) -> Dataset:
    """Read a campaign's folder, or bags and folders of bags.

    What cannot be analysed is left out, with a warning and a note in the dataset.

    Raises:
        ConfigError: nothing can be analysed, or a campaign's folder is among other paths.
    """
    campaigns = [path for path in paths if path.is_dir() and is_campaign(path)]
    if campaigns and len(paths) > 1:
        raise ConfigError(f"{campaigns[0]}: a campaign's folder; expected it alone, or bags")
    dataset = campaign_dataset(campaigns[0]) if campaigns else bag_dataset(paths)
    for note in dataset.notes:
        log.warning('%s', note)
    return dataset._replace(
        trials=[trial for trials in dataset.cells().values() for trial in sorted(trials, key=lambda trial: trial.trial)]
    )
