"""What the terminal shows of a dataset: one row a cell, or one row a trial where there are few."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.dataset import Dataset, TrialData, Varied
from diff_encoder_sim.analysis.final_errors import count_within_all, final_errors, with_final_error
from diff_encoder_sim.analysis.quantities import YAW, X, Y
from diff_encoder_sim.analysis.table_keys import varied_texts
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

CELL_LEGEND = (
    f'%: trials that end within {X.tolerance:g} m of the goal in x and y each, and '
    f'within {YAW.tolerance:g} degrees,\nby what each source says (world is the truth); '
    f'spread: standard deviation, x and y together.'
)
TRIAL_LEGEND = 'Where each source says that the robot ended, minus the goal: distance and heading (world is the truth).'


def summary(dataset: Dataset) -> str:
    """A table and its legend."""
    if all(len(trials) == 1 for trials in dataset.cells().values()):
        return f'{trial_table(dataset)}\n{TRIAL_LEGEND}'
    return f'{cell_table(dataset)}\n{CELL_LEGEND}'


def cell_table(dataset: Dataset) -> str:
    """One row a cell: how many trials, how many succeeded, and each source at the goal."""
    headers = [
        'test',
        'PPR',
        'trials',
        'reached',
        *(f'{source.value}\n{what}' for source in PoseSource for what in ('%', 'spread\n[m]')),
    ]
    rows = []
    for cell, trials in dataset.cells().items():
        reached = sum(trial.outcome is Outcome.SUCCEEDED for trial in trials)
        row = [_name(cell.test, cell.varied), cell.ppr, len(trials), reached]
        for source in PoseSource:
            row += [_fraction_within(trials, source), _spread(trials, source)]
        rows.append(row)
    return _table(rows, headers)


def trial_table(dataset: Dataset) -> str:
    """One row a trial: how it ended and where."""
    headers = [
        'test',
        'PPR',
        'trial',
        'outcome',
        'seconds',
        'path\n[m]',
        *(f'{source.value}\n{unit}' for source in PoseSource for unit in ('[m]', '[deg]')),
    ]
    rows = []
    for trial in dataset.trials:
        row = [
            _name(trial.test, trial.varied),
            trial.ppr,
            trial.trial,
            trial.outcome.text,
            f'{trial.duration_s:.1f}',
            f'{trial.distance_m:.2f}',
        ]
        for source in PoseSource:
            row += _distance_and_heading(trial.errors.get(source))
        rows.append(row)
    return _table(rows, headers)


def _name(test: str, varied: Varied) -> str:
    return '\n'.join([test, *varied_texts(varied)])


def _fraction_within(trials: Sequence[TrialData], source: PoseSource) -> str:
    count = len(with_final_error(trials, source))
    return f'{100.0 * (count_within_all(trials, source) / count):.0f}' if count else ''


def _spread(trials: Sequence[TrialData], source: PoseSource) -> str:
    if len(with_final_error(trials, source)) < 2:
        return ''
    std_m = [np.std(final_errors(trials, source, quantity), ddof=1) for quantity in (X, Y)]
    return f'{math.hypot(*std_m):.4f}'


def _distance_and_heading(error: Optional[Pose2D]) -> List[str]:
    if error is None:
        return ['', '']
    return [f'{math.hypot(error.x_m, error.y_m):.4f}', f'{math.degrees(error.yaw_rad):+.2f}']


def _table(rows: List[list], headers: List[str]) -> str:
    return tabulate(rows, headers, disable_numparse=True, stralign='right')
