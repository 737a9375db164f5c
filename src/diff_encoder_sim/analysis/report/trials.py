"""Every trial in a row: how it ended, and the errors of each pose source."""

from __future__ import annotations

import math
import os
import urllib.parse
from pathlib import Path
from typing import List, NamedTuple, Optional

from diff_encoder_sim.analysis.dataset import Dataset, TrialData
from diff_encoder_sim.analysis.first_trials import first_of_cells, sample_text
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_text, key_columns, key_entries, varied_keys
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

_NOTE = (
    "Topics: distance from the goal, and heading minus the goal's, at the end. ATE: root mean square of the "
    'distance between /odom, its first pose aligned, and the true pose along the path.'
)


class BagLink(NamedTuple):
    """A link to a trial's recording."""

    name: str
    href: str  # relative to the report


def trial_table(dataset: Dataset) -> Table:
    """Build the table of all trials: outcome, the final error of each source, and the odometry's ATE."""
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = [_row(trial, keys) for trial in dataset.trials]
    return Table('trials', 'All trials', [*key_columns(keys), *_columns()], rows, [_NOTE])


def _columns() -> List[Column]:
    return [
        Column('ppr', 'PPR'),
        Column('trial', 'trial'),
        Column('outcome', 'outcome'),
        Column('duration_s', 'time [s]'),
        Column('distance_m', 'path [m]'),
        *(
            Column(f'{source.value}_{part}', f'{topic} {head}')
            for source, topic in TOPIC_OF_SOURCE.items()
            for part, head in (('m', '[m]'), ('deg', '[deg]'))
        ),
        Column('odom_ate_m', '/odom ATE [m]'),
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
        *(number for source in PoseSource for number in _distance_and_heading(trial.errors.get(source))),
        Number(path and path.ate_rmse_m, 4),
    ]


def _distance_and_heading(error: Optional[Pose2D]) -> List[Entry]:
    if error is None:
        return [Number(None, 4), Number(None, 2)]
    return [Number(math.hypot(error.x_m, error.y_m), 4), Number(math.degrees(error.yaw_rad), 2)]


def failure_table(dataset: Dataset) -> Table:
    """Build the table of the trials that did not succeed, with the reasons; of many, some."""
    failed = dataset._replace(trials=[trial for trial in dataset.trials if trial.outcome is not Outcome.SUCCEEDED])
    shown = first_of_cells(failed)
    columns = [Column(name, name) for name in ('cell', 'trial', 'outcome', 'reason')]
    rows: List[List[Entry]] = [
        [cell_text(trial.cell), Number(trial.trial, 0), trial.outcome.text, trial.reason] for trial in shown.trials
    ]
    notes = [f'{text}.' for text in [sample_text(shown, failed)] if text]
    return Table('failures', 'Trials that did not succeed', columns, rows, notes)


def bag_links(dataset: Dataset, folder: Path) -> List[Optional[BagLink]]:
    """Return a link to each trial's bag from a page in `folder`; None for a trial without a bag."""
    return [None if trial.bag is None else _link(trial.bag, folder) for trial in dataset.trials]


def _link(bag: Path, folder: Path) -> BagLink:
    relative = os.path.relpath(str(bag.resolve()), str(folder.resolve()))
    return BagLink(bag.name, urllib.parse.quote(relative, safe='/'))
