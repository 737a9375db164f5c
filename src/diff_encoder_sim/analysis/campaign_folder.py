"""Reads the results of a campaign from its folder: manifest.json and trials.csv."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Tuple

from diff_encoder_sim.analysis.dataset import RobotGeometry
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.trial_definition import Trial
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
