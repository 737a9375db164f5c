"""Summary of results for the terminal: one row per cell, or per trial if each cell has one trial."""

from __future__ import annotations

import math
from typing import List

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, POSES, X, Y
from diff_encoder_sim.analysis.results_table import SUCCEEDED, Results, are_within, final_errors, varied_texts
from diff_encoder_sim.analysis.within_tolerance import TOLERANCE_TEXT
from diff_encoder_sim.base.deferred import pandas as pd

SOURCES_LEGEND = (
    'odom: wheel odometry; amcl: last /amcl_pose; global: pose estimate (/global_pose); world: ground truth;\n'
    'odom - world: odometry minus ground truth, the odometry error.'
)
CELL_LEGEND = (
    f'Final pose minus goal by pose source. %: trials that end {TOLERANCE_TEXT};\n'
    f'std dev: standard deviation of the position, x and y together.\n{SOURCES_LEGEND}'
)
TRIAL_LEGEND = f'Final pose minus goal by pose source: distance and heading.\n{SOURCES_LEGEND}'


def summary(results: Results) -> str:
    """Return a table and its legend."""
    if results.trials['cell'].duplicated().any():
        rows = [_cell_row(results, of_cell) for _, of_cell in results.trials.groupby('cell', sort=False)]
        heads, legend = ['test', 'PPR', 'trials', 'succeeded'], CELL_LEGEND
        columns = ('%', 'std dev\n[m]')
    else:
        rows = [_trial_row(results, trial) for _, trial in results.trials.iterrows()]
        heads, legend = ['test', 'PPR', 'trial', 'outcome', 'time\n[s]', 'path\n[m]'], TRIAL_LEGEND
        columns = ('[m]', '[deg]')
    texts = {**{pose: f'\n{pose}' for pose in POSES}, MINUS_TRUTH: 'odom -\nworld'}
    heads += [f'{text}\n{column}' for text in texts.values() for column in columns]
    return f'{tabulate(rows, heads, disable_numparse=True, stralign="right")}\n{legend}'


def _cell_row(results: Results, of_cell: pd.DataFrame) -> List[str]:
    first, succeeded = of_cell.iloc[0], (of_cell['outcome'] == SUCCEEDED).sum()
    row = [_name(results, first), first['ppr'], f'{len(of_cell)}', f'{succeeded}']
    for pose in POSES:
        within = are_within(of_cell, pose)
        row.append(f'{100.0 * np.mean(within):.0f}' if len(within) else '')
        stds_m = [np.std(final_errors(of_cell, pose, axis), ddof=1) for axis in (X, Y) if len(within) > 1]
        row.append(f'{math.hypot(*stds_m):.4f}' if stds_m else '')
    return row


def _trial_row(results: Results, trial: pd.Series) -> List[str]:
    row = [_name(results, trial), trial['ppr'], f'{trial["trial"]}', trial['outcome'].replace('_', ' ')]
    row += [f'{trial["duration_s"]:.1f}', f'{trial["distance_m"]:.2f}']
    for pose in POSES:
        x_m, y_m, yaw_rad = (trial[f'{pose}_{part}'] for part in ('x_m', 'y_m', 'yaw_rad'))
        row += ['', ''] if math.isnan(x_m) else [f'{math.hypot(x_m, y_m):.4f}', f'{math.degrees(yaw_rad):+.2f}']
    return row


def _name(results: Results, first: pd.Series) -> str:
    return '\n'.join([first['test'], *varied_texts(list(first[results.varied]), results.varied)])
