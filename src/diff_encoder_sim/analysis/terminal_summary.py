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
from diff_encoder_sim.trials.trials_csv import PARTS

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
    is_pooled = results.trials['cell'].duplicated().any()
    rows = []
    for _, of_cell in results.trials.groupby('cell', sort=False):
        first = of_cell.iloc[0]
        name = '\n'.join([first['test'], *varied_texts(list(first[results.varied]), results.varied)])
        if is_pooled:
            row = [name, first['ppr'], f'{len(of_cell)}', f'{(of_cell["outcome"] == SUCCEEDED).sum()}']
        else:
            row = [name, first['ppr'], f'{first["trial"]}', first['outcome'].replace('_', ' ')]
            row += [f'{first["duration_s"]:.1f}', f'{first["distance_m"]:.2f}']
        for pose in POSES:
            row += _pooled_texts(of_cell, pose) if is_pooled else _error_texts(first, pose)
        rows.append(row)
    heads, columns, legend = ['trials', 'succeeded'], ('%', 'std dev\n[m]'), CELL_LEGEND
    if not is_pooled:
        heads, columns, legend = ['trial', 'outcome', 'time\n[s]', 'path\n[m]'], ('[m]', '[deg]'), TRIAL_LEGEND
    texts = {**{pose: f'\n{pose}' for pose in POSES}, MINUS_TRUTH: 'odom -\nworld'}
    heads = ['test', 'PPR', *heads, *(f'{text}\n{column}' for text in texts.values() for column in columns)]
    return f'{tabulate(rows, heads, disable_numparse=True, stralign="right")}\n{legend}'


def _pooled_texts(of_cell: pd.DataFrame, pose: str) -> List[str]:
    within = are_within(of_cell, pose)
    stds_m = [np.std(final_errors(of_cell, pose, axis), ddof=1) for axis in (X, Y) if len(within) > 1]
    return [f'{100.0 * np.mean(within):.0f}' if len(within) else '', f'{math.hypot(*stds_m):.4f}' if stds_m else '']


def _error_texts(trial: pd.Series, pose: str) -> List[str]:
    x_m, y_m, yaw_rad = (trial[f'{pose}_{part}'] for part in PARTS)
    return ['', ''] if math.isnan(x_m) else [f'{math.hypot(x_m, y_m):.4f}', f'{math.degrees(yaw_rad):+.2f}']
