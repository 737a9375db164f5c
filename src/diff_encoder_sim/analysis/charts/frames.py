"""Data of charts as DataFrames: errors of trials, spread, closed form, paths and maps.

`trials` is `Results.trials` or a part of it.
"""

from __future__ import annotations

import base64
import io
import math
from pathlib import Path
from typing import Sequence

import numpy as np
from PIL import Image

from diff_encoder_sim.analysis.charts.drawings import LABELS, floor_of
from diff_encoder_sim.analysis.closed_form import closed_form_std
from diff_encoder_sim.analysis.encoder_labels import is_real, ppr_text, ppr_value, ppr_values
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES
from diff_encoder_sim.analysis.results_table import Results, encoders, final_errors
from diff_encoder_sim.analysis.statistics import spread, std_interval
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import find_world
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED

OF_LABEL = dict(zip(LABELS, (MINUS_TRUTH, 'odom', 'world', 'global', 'amcl')))

APART = 1.07  # factor in counts between neighbouring series
CLOSED_FORM_POINTS = 40
MOST_PATHS = 400  # keeps the page below 3 MB
STRAIGHT_WITHIN = 1.5e-3  # tolerance of simplified paths as a fraction of the floor's sides


def trial_rows(trials: pd.DataFrame) -> pd.DataFrame:
    """Return a row per trial (its index is `trial`): number, seed, bag and outcome as texts."""
    rows = pd.DataFrame({'trial': trials.index, 'number': trials['trial']})
    rows['seed'] = trials['seed'].astype(str)  # browsers round large numbers
    rows['bag'] = [Path(bag).name or 'none' for bag in trials['bag']]
    return rows.assign(outcome=trials['outcome'].str.replace('_', ' '))


def error_rows(trials: pd.DataFrame) -> pd.DataFrame:
    """Return a row per trial (its index) and available series of errors: x and y [m], yaw [deg], rounded."""
    keys = pd.DataFrame({'trial': trials.index, 'setup': trials['setup'], 'encoder': trials['ppr']})
    values = {
        label: {each.axis: (each.scale * trials[each.column(pose)]).round(5) for each in QUANTITIES}
        for label, pose in OF_LABEL.items()
    }
    rows = pd.concat([keys.assign(series=label, **errors).dropna() for label, errors in values.items()])
    return rows.sort_values('trial', kind='stable', ignore_index=True)


def spread_rows(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the standard deviations by cell with counts, series and quantity; without those of equal errors."""
    rows = []
    for (setup, encoder), cell in trials.groupby(['setup', 'ppr'], sort=False):
        ppr = ppr_value(encoder)
        if ppr is None:
            continue
        for place, (label, pose) in enumerate(OF_LABEL.items(), -(len(LABELS) // 2)):
            for quantity in QUANTITIES:
                values = final_errors(cell, pose, quantity)
                if std := spread(values):
                    key = setup, encoder, ppr_text(encoder), label, quantity.axis, ppr, is_real(encoder), len(values)
                    stds = ppr * APART**place, std, *std_interval(values)
                    rows.append((*key, *(float(f'{value:.4g}') for value in stds)))
    names = 'setup encoder label series quantity ppr is_real trials place std low high'
    return pd.DataFrame(rows, columns=names.split())


def closed_form_rows(results: Results) -> pd.DataFrame:
    """Return points of the closed form of quantisation over the range of encoders, by test."""
    pprs, rows = ppr_values(encoders(results.trials)), []
    points = np.geomspace(pprs[0], pprs[-1], CLOSED_FORM_POINTS if len(pprs) > 1 else 1).tolist() if pprs else []
    for test, setup in results.trials[['test', 'setup']].drop_duplicates().itertuples(index=False):
        for ppr in points if test in results.requested else ():
            stds = closed_form_std(results.requested[test], results.robot, ppr)
            for quantity in QUANTITIES:
                std = quantity.scale * float(stds[quantity.component])
                if std:
                    rows.append((setup, quantity.axis, float(f'{ppr:.4g}'), float(f'{std:.4g}')))
    return pd.DataFrame(rows, columns=['setup', 'quantity', 'ppr', 'std'])


def with_paths(trials: pd.DataFrame, most: int = MOST_PATHS) -> pd.DataFrame:
    """Return the trials with displayed paths: the first with a bag of each cell, about `most` in total."""
    of_each = max(1, most // max(1, trials['cell'].nunique()))
    return trials[trials['true_path'].notna()].groupby('cell', sort=False).head(of_each)


def path_rows(trials: pd.DataFrame, floors: pd.DataFrame) -> pd.DataFrame:
    """Return two rows per trial, with the simplified true path and that of /odom: lists of x and y [m]."""
    rows = []
    for trial, of_trial in trials.iterrows():
        sides_m = floors.loc[of_trial['test'], ['width', 'height']].to_numpy()
        for name, column in (('true path', 'true_path'), ('/odom', 'odom_path')):
            points_m = np.round(sides_m * simplified(of_trial[column] / sides_m, STRAIGHT_WITHIN), 3)
            rows.append((trial, of_trial['ppr'], name, *points_m.T.tolist()))
    return pd.DataFrame(rows, columns=['trial', 'encoder', 'path', 'x', 'y'])


def simplified(points: np.ndarray, within: float) -> np.ndarray:
    """Return those (n, 2) points of a polyline that the Ramer-Douglas-Peucker algorithm keeps; others are `within`."""
    if len(points) < 3:
        return points
    along, offsets = points[-1] - points[0], points - points[0]
    nearest = np.clip(offsets @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    distances = np.hypot(*(offsets - nearest[:, np.newaxis] * along).T)
    farthest = int(distances.argmax())
    if distances[farthest] <= within:
        return points[[0, -1]]
    parts = simplified(points[: farthest + 1], within), simplified(points[farthest:], within)
    return np.concatenate([parts[0][:-1], parts[1]])


def floor_rows(trials: pd.DataFrame, results: Results) -> pd.DataFrame:
    """Return the `floor_of` the paths, start and goal of each test [m]."""
    rows = {}
    for test, of_test in trials.groupby('test', sort=False):
        ends = mark_rows(results, [test])[['x', 'y']].to_numpy(dtype=float)
        rows[test] = floor_of(np.vstack([*of_test['true_path'], *of_test['odom_path'], ends]))
    return pd.DataFrame.from_dict(rows, orient='index')


def mark_rows(results: Results, tests: Sequence[str]) -> pd.DataFrame:
    """Return the start and goal of each test [m]."""
    poses = {test: (one.test.start.pose(), one.goal()) for test, one in results.requested.items() if test in tests}
    rows = [
        (test, name, round(pose.x_m, 3), round(pose.y_m, 3))
        for test, ends in poses.items()
        for name, pose in zip(('start', 'goal'), ends)
    ]
    return pd.DataFrame(rows, columns=['test', 'mark', 'x', 'y'])


def map_rows(results: Results, tests: Sequence[str]) -> pd.DataFrame:
    """Return the map of each test's world as an image with its borders [m]; rotated and missing maps are left out."""
    rows = []
    for test in (test for test in tests if test in results.requested):
        try:
            world = find_world(results.requested[test].test.world, package_folder() / 'worlds')
            grid = load_map(world.with_suffix('.yaml'))
        except ConfigError:
            continue
        if math.isclose(grid.origin.yaw_rad, 0.0):
            left, bottom = grid.origin.x_m, grid.origin.y_m
            right, top = left + grid.width * grid.resolution_m, bottom + grid.height * grid.resolution_m
            pixels, file = np.zeros((*grid.cells.shape, 2), np.uint8), io.BytesIO()
            pixels[grid.cells[::-1] == OCCUPIED] = (153, 255)  # grey on transparent
            Image.fromarray(pixels, 'LA').save(file, 'PNG', optimize=True)
            url = 'data:image/png;base64,' + base64.b64encode(file.getvalue()).decode('ascii')
            rows.append((test, url, left, bottom, right, top))
    return pd.DataFrame(rows, columns=['test', 'url', 'left', 'bottom', 'right', 'top'])
