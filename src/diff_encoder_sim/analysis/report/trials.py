"""Every trial in a row: how it ended, and how far each source was off."""

from __future__ import annotations

import math
import os
import urllib.parse
from pathlib import Path
from typing import List, NamedTuple, Optional

from diff_encoder_sim.analysis.dataset import Dataset, TrialData
from diff_encoder_sim.analysis.table_files import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_head, key_columns, key_entries, varied_keys
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome


class BagLink(NamedTuple):
    """Where a trial's recording is."""

    name: str
    href: str  # relative to the report


def trial_table(dataset: Dataset) -> Table:
    """Where each source says that the robot ended, minus the goal, and its error on the way."""
    keys = varied_keys(dataset)
    columns = [
        *key_columns(keys),
        Column('ppr', 'PPR'),
        Column('trial', 'trial'),
        Column('outcome', 'outcome'),
        Column('duration_s', 'time [s]'),
        Column('distance_m', 'path [m]'),
    ]
    columns += [
        Column(f'{source.value}_{part}', f'{topic} {head}')
        for source, topic in TOPIC_OF_SOURCE.items()
        for part, head in (('m', '[m]'), ('deg', '[deg]'))
    ]
    columns.append(Column('odom_ate_m', '/odom on the way [m]'))
    rows: List[List[Entry]] = [_row(trial, keys) for trial in dataset.trials]
    return Table(
        'trials',
        'All trials',
        columns,
        rows,
        [
            "By source: distance from the goal, and heading minus the goal's, at the end. On the "
            'way: root mean square of the distance from the truth (ATE, nothing aligned).'
        ],
    )


def failure_table(dataset: Dataset) -> Table:
    """The trials that did not succeed, and why."""
    columns = [
        Column('cell', 'cell'),
        Column('trial', 'trial'),
        Column('outcome', 'outcome'),
        Column('reason', 'reason'),
    ]
    return Table(
        'failures',
        'Trials that did not succeed',
        columns,
        [
            [cell_head(trial.cell), Number(trial.trial, 0), trial.outcome.text, trial.reason]
            for trial in dataset.trials
            if trial.outcome is not Outcome.SUCCEEDED
        ],
        [],
    )


def bag_links(dataset: Dataset, folder: Path) -> List[Optional[BagLink]]:
    """For each trial, as a page in `folder` would name it; None for a trial without a bag."""
    return [
        trial.bag
        and BagLink(
            trial.bag.name,
            urllib.parse.quote(os.path.relpath(str(trial.bag.resolve()), str(folder.resolve())), safe='/'),
        )
        for trial in dataset.trials
    ]


def _row(trial: TrialData, keys: List[str]) -> List[Entry]:
    path = trial.paths.get(PoseSource.ODOM)
    return [
        *key_entries(trial.test, trial.varied, keys),
        trial.ppr,
        Number(trial.trial, 0),
        trial.outcome.text,
        Number(trial.duration_s, 1),
        Number(trial.distance_m, 2),
        *(number for source in PoseSource for number in _off_by(trial.errors.get(source))),
        Number(path and path.ate_rmse_m, 4),
    ]


def _off_by(error: Optional[Pose2D]) -> List[Entry]:
    if error is None:
        return [Number(None, 4), Number(None, 2)]
    return [Number(math.hypot(error.x_m, error.y_m), 4), Number(math.degrees(error.yaw_rad), 2)]
