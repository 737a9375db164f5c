"""The summary of a dataset for the terminal: one row per cell, or per trial where each cell has one."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.dataset import Dataset, TrialData, Varied
from diff_encoder_sim.analysis.final_errors import count_within_all, final_errors, minus_truth, with_final_error
from diff_encoder_sim.analysis.quantities import X, Y
from diff_encoder_sim.analysis.table_keys import varied_texts
from diff_encoder_sim.analysis.within_tolerance import TOLERANCE_TEXT
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

SOURCES_LEGEND = (
    'odom: wheel odometry; amcl: last /amcl_pose; global: pose estimate (/global_pose); world: ground truth;\n'
    "odom - world: odometry minus ground truth, the odometry's own error."
)
CELL_LEGEND = (
    f'Final pose minus goal by pose source. %: trials that end {TOLERANCE_TEXT};\n'
    f'std dev: standard deviation of the position, x and y together.\n{SOURCES_LEGEND}'
)
TRIAL_LEGEND = f'Final pose minus goal by pose source: distance and heading.\n{SOURCES_LEGEND}'


def summary(dataset: Dataset) -> str:
    """Return a table and its legend."""
    if all(len(trials) == 1 for trials in dataset.cells().values()):
        return f'{trial_table(dataset)}\n{TRIAL_LEGEND}'
    return f'{cell_table(dataset)}\n{CELL_LEGEND}'


def cell_table(dataset: Dataset) -> str:
    """Return one row per cell: number of trials, how many succeeded, and the final errors of each source."""
    headers = ['test', 'PPR', 'trials', 'succeeded', *_source_headers('%', 'std dev\n[m]')]
    rows = []
    for cell, trials in dataset.cells().items():
        succeeded = sum(trial.outcome is Outcome.SUCCEEDED for trial in trials)
        row = [_name(cell.test, cell.varied), cell.ppr, f'{len(trials)}', f'{succeeded}']
        for of_pose, source in (*((trials, source) for source in PoseSource), (minus_truth(trials), PoseSource.ODOM)):
            row += [_percent_within(of_pose, source), _position_std(of_pose, source)]
        rows.append(row)
    return _table(rows, headers)


def trial_table(dataset: Dataset) -> str:
    """Return one row per trial: how it ended, and the final error of each source."""
    headers = ['test', 'PPR', 'trial', 'outcome', 'time\n[s]', 'path\n[m]', *_source_headers('[m]', '[deg]')]
    rows = []
    for trial in dataset.trials:
        row = [_name(trial.test, trial.varied), trial.ppr, f'{trial.trial}', trial.outcome.text]
        row += [f'{trial.duration_s:.1f}', f'{trial.distance_m:.2f}']
        for error in (*(trial.errors.get(source) for source in PoseSource), trial.odometry_minus_truth):
            row += _distance_and_heading(error)
        rows.append(row)
    return _table(rows, headers)


def _source_headers(*columns: str) -> List[str]:
    poses = [*(f'\n{source.value}' for source in PoseSource), 'odom -\nworld']
    return [f'{pose}\n{column}' for pose in poses for column in columns]


def _name(test: str, varied: Varied) -> str:
    return '\n'.join([test, *varied_texts(varied)])


def _percent_within(trials: Sequence[TrialData], source: PoseSource) -> str:
    count = len(with_final_error(trials, source))
    return f'{100.0 * (count_within_all(trials, source) / count):.0f}' if count else ''


def _position_std(trials: Sequence[TrialData], source: PoseSource) -> str:
    if len(with_final_error(trials, source)) < 2:
        return ''
    std_m = [np.std(final_errors(trials, source, quantity), ddof=1) for quantity in (X, Y)]
    return f'{math.hypot(*std_m):.4f}'


def _distance_and_heading(error: Optional[Pose2D]) -> List[str]:
    if error is None:
        return ['', '']
    return [f'{math.hypot(error.x_m, error.y_m):.4f}', f'{math.degrees(error.yaw_rad):+.2f}']


def _table(rows: List[List[str]], headers: List[str]) -> str:
    return tabulate(rows, headers, disable_numparse=True, stralign='right')
