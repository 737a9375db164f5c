#!/usr/bin/env python3
"""The causes of the true pose's error at the goal in results of campaigns: stopping, localization or both.

accuracy.py results/paper results/accurate
"""

from __future__ import annotations

from pathlib import Path
from typing import List

import numpy as np
from bench import minus, parser, print_header, print_table, spreads

from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.analysis.results_table import Results
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.trials.trials_csv import PARTS

TOLERANCES = np.array([each.tolerance / each.scale for each in QUANTITIES])
SPREADS = [
    f'{what}\n{part}'
    for what in ('estimate\n- goal', 'truth\n- estimate', 'odometry\n- truth')
    for part in ('along [mm]', 'across [mm]', 'yaw [deg]')
]
LEGEND = """Outside: more than 0.05 m in x or y or 3 degrees from the goal. Of these, "by stopping" would be with
perfect localization, "by localization" with a perfect stop (both may hold), "only together" with neither alone.
Along and across: of the heading at the goal."""


def main() -> None:
    made = parser(__doc__)
    made.add_argument('results', nargs='+', type=Path, help='results folders of campaigns')
    print_header('final poses of campaigns')
    for folder in made.parse_args().results:
        _print(folder, load_results([folder]))
    print(LEGEND)


def _print(folder: Path, results: Results) -> None:
    cells = ['test', *results.varied, 'ppr']
    causes, spreads = [], []
    for cell, rows in results.trials.groupby(cells, sort=False):
        causes.append([*cell, *_causes(_errors(rows, results))])
        spreads.append([*cell, *_spreads(_errors(rows, results))])
    for test, rows in results.trials.groupby('test', sort=False):
        spreads.append([test, *[''] * len(results.varied), 'all', *_spreads(_errors(rows, results))])
    print(folder)
    print_table(causes, [*cells, 'truth outside', 'by stopping', 'by localization', 'only together'], len(cells))
    print_table(spreads, [*cells, *SPREADS], len(cells))


def _errors(rows: pd.DataFrame, results: Results) -> np.ndarray:
    """Return (3, n, 3) errors along and across the goal's heading: pose estimate, true pose and odometry minus goal."""
    poses = [rows[[f'{pose}_{part}' for part in PARTS]].to_numpy(float) for pose in ('global', 'world', 'odom')]
    yaws_rad = np.array([results.requested[test].goal().yaw_rad for test in rows['test']])
    cos, sin = np.cos(yaws_rad), np.sin(yaws_rad)
    x, y, yaw = np.moveaxis(np.array(poses), 2, 0)
    errors = np.stack([cos * x + sin * y, cos * y - sin * x, yaw], axis=-1)
    return errors[:, np.isfinite(errors).all(axis=(0, 2))]


def _causes(errors: np.ndarray) -> List[str]:
    estimate, truth, _ = errors
    errors_of = truth, estimate, minus(truth, estimate)
    outside, stopping, localization = ((np.abs(each) > TOLERANCES).any(axis=1) for each in errors_of)
    counts = (outside & stopping, outside & localization, outside & ~stopping & ~localization)
    return [f'{outside.sum()}/{len(outside)}', *(str(each.sum()) for each in counts)]


def _spreads(errors: np.ndarray) -> List[str]:
    estimate, truth, odometry = errors
    return [*spreads(estimate), *spreads(minus(truth, estimate)), *spreads(minus(odometry, truth))]


if __name__ == '__main__':
    main()
