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
    if not results.trials['cell'].duplicated().any():
        return f'{trial_table(results)}\n{TRIAL_LEGEND}'
    return f'{cell_table(results)}\n{CELL_LEGEND}'


def cell_table(results: Results) -> str:
    """Return one row per cell: trials, succeeded trials, and the final errors of each pose."""
    headers = ['test', 'PPR', 'trials', 'succeeded', *_pose_headers('%', 'std dev\n[m]')]
    rows = []
    for _, of_cell in results.trials.groupby('cell', sort=False):
        first, succeeded = of_cell.iloc[0], (of_cell['outcome'] == SUCCEEDED).sum()
        row = [_name(results, first), first['ppr'], f'{len(of_cell)}', f'{succeeded}']
        for pose in POSES:
            within = are_within(of_cell, pose)
            row.append(f'{100.0 * np.mean(within):.0f}' if len(within) else '')
            stds_m = [np.std(final_errors(of_cell, pose, axis), ddof=1) for axis in (X, Y) if len(within) > 1]
            row.append(f'{math.hypot(*stds_m):.4f}' if stds_m else '')
        rows.append(row)
    return tabulate(rows, headers, disable_numparse=True, stralign='right')


def trial_table(results: Results) -> str:
    """Return one row per trial: outcome and final error of each pose."""
    headers = ['test', 'PPR', 'trial', 'outcome', 'time\n[s]', 'path\n[m]', *_pose_headers('[m]', '[deg]')]
    rows = []
    for _, trial in results.trials.iterrows():
        row = [_name(results, trial), trial['ppr'], f'{trial["trial"]}', trial['outcome'].replace('_', ' ')]
        row += [f'{trial["duration_s"]:.1f}', f'{trial["distance_m"]:.2f}']
        for pose in POSES:
            x_m, y_m, yaw_rad = (trial[f'{pose}_{part}'] for part in ('x_m', 'y_m', 'yaw_rad'))
            is_known = not math.isnan(x_m)
            row += [f'{math.hypot(x_m, y_m):.4f}', f'{math.degrees(yaw_rad):+.2f}'] if is_known else ['', '']
        rows.append(row)
    return tabulate(rows, headers, disable_numparse=True, stralign='right')


def _pose_headers(*columns: str) -> List[str]:
    heads = {pose: f'\n{pose}' for pose in POSES}
    heads[MINUS_TRUTH] = 'odom -\nworld'
    return [f'{head}\n{column}' for head in heads.values() for column in columns]


def _name(results: Results, first: pd.Series) -> str:
    return '\n'.join([first['test'], *varied_texts(list(first[results.varied]), results.varied)])
