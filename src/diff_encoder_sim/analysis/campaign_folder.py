"""The results of a campaign as its folder has them: manifest.json and trials.csv."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Set, Tuple

from diff_encoder_sim.analysis.dataset import RobotGeometry
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.campaign.folder import MANIFEST, TABLE
from diff_encoder_sim.campaign.trial_row import TrialRow, csv_fields, header, row_of
from diff_encoder_sim.trials.trial_definition import Trial


class Manifest(NamedTuple):
    """What manifest.json says that trials are compared with."""

    content: Dict[str, Any]  # all of it
    name: str
    asked: Dict[str, Trial]  # by test
    robots: List[RobotGeometry]  # of each set of parameters
    varied_keys: List[str]
    trial_count: int  # of the whole campaign


class CampaignFolder(NamedTuple):
    """A campaign's results, whole or as far as they have come."""

    manifest: Manifest
    rows: List[TrialRow]
    notes: List[str]  # what is missing, a line each


def is_campaign(folder: Path) -> bool:
    """Whether a campaign has written there."""
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
        asked = [
            Trial.from_mapping(
                {'nav': configuration['nav'], 'test': {key: value for key, value in test.items() if key != 'files'}},
                str(path),
            )
            for test in configuration['tests']
        ]
        parameters = configuration['parameters']
        count = len(asked) * len(parameters) * len(configuration['ppr']) * configuration['trials']
        return Manifest(
            content,
            str(content['name']),
            {trial.test.name: trial for trial in asked},
            [
                RobotGeometry(float(each['odometry']['wheel_diameter']), float(each['odometry']['wheel_separation']))
                for each in parameters
            ],
            sorted(parameters[0]['varied']),
            int(count),
        )
    except (KeyError, IndexError, TypeError, AttributeError, json.JSONDecodeError):
        raise ConfigError(f'{path}: not the manifest of a campaign; expected it as campaign wrote it') from None


def _rows(path: Path, manifest: Manifest) -> Tuple[List[TrialRow], List[str]]:
    """The trials, and a note where the last line is torn."""
    lines = _text(path).split('\n')
    head = header(manifest.varied_keys)
    # A line is written at one stroke and ends last: what follows the last end is torn.
    torn = lines.pop()
    notes = [f'{path}: the last line is torn; its trial is left out'] if torn else []
    rows: List[TrialRow] = []
    seen: Set[Tuple] = set()
    for number, line in enumerate(lines, start=1):
        try:
            fields = csv_fields(line.encode('utf-8'))
            if number == 1:
                _check(fields == head)
                continue
            row = row_of(fields, manifest.varied_keys)
            _check(row.test in manifest.asked and row.identity() not in seen and _is_finite(row))
        except ValueError:
            raise ConfigError(
                f'{path}: line {number} is not of the campaign of {MANIFEST}, is '
                f'there twice or has a number that is not finite; expected it as '
                f'campaign wrote it'
            ) from None
        seen.add(row.identity())
        rows.append(row)
    return rows, notes


def _is_finite(row: TrialRow) -> bool:
    errors = itertools.chain.from_iterable(error for error in row.errors.values() if error)
    return all(map(math.isfinite, (row.duration_s, row.distance_m, *errors)))


def _check(is_right: bool) -> None:
    if not is_right:
        raise ValueError


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding='utf-8')
    except FileNotFoundError:
        raise ConfigError(f'{path}: no such file; expected a folder that campaign wrote, or bags') from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: cannot be read: {error}') from None
