"""The results of trials as one table, which all statistics, tables, figures and reports are functions of.

`Results.trials` is a pandas DataFrame with a row for each trial: the tests of the paper first, then by varied
parameters in the order of their appearance, encoders ascending, trials by number. The index counts from 0. Its columns:

- `test`, `ppr`: name of the test, label of the encoder.
- one for each of `Results.varied`: value of a varied parameter, as text; `variant` is the name of a set of values.
- `trial`, `seed`: number of the trial; trials of equal number in other cells have equal random draws: they are pairs.
- `outcome`, `reason`: value of `Outcome`; reason of a failure.
- `duration_s`, `distance_m`, `wall_time_s`: simulated time, length of the true path, time to compute (NaN for bags).
- `odom_x_m`, `odom_y_m`, `odom_yaw_rad`: final /odom minus the goal along the map's axes; NaN without one, or if torn.
- `amcl_*`, `global_*`, `world_*`: the same of /amcl_pose, /global_pose, /world_pose.
- `odom_minus_world_*`: final /odom minus final /world_pose: the odometry's own error.
- `bag`: path of the bag, as text; '' if there is none, or it could not be read.
- `setup`: the test with its varied parameters, as tables show it: `SL, noise 0.03`.
- `cell`: the same with the encoder: `SL, 90 PPR, noise 0.03`; trials of a cell differ in their seed only.
- `odom_ate_rmse_m`, `odom_ate_max_m`, `odom_yaw_rmse_rad`: over the whole path; NaN without a bag; also `amcl_*`,
  `global_*`.
- `odom_rpe_1m_segments`, `odom_rpe_1m_translation_rmse_m`, `odom_rpe_1m_rotation_rmse_rad`: of each of `RPES`.
- `true_path`, `odom_path`: (n, 2) arrays [m] in the map frame, at most `MOST_POINTS`; None without a bag.

`trials.groupby('cell', sort=False)` are the cells in the order of all tables, `groupby('setup', sort=False)` the tests.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_order, ppr_text
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH, QUANTITIES, Quantity
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, Alignment, RpePairs, rpe_name
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome, Trial
from diff_encoder_sim.trials.trials_csv import PARTS, VARIANT, TrialRow, header

# The paper's tests, first in every table; others follow.
STANDARD_TESTS = ('SL', 'SMT', 'DLD')

MOST_POINTS = 600  # of a path
SUCCEEDED = Outcome.SUCCEEDED.value

# Odometry begins anywhere; the other sources estimate the pose in the map.
ALIGNMENTS = {PoseSource.ODOM: Alignment.ORIGIN, PoseSource.AMCL: Alignment.NONE, PoseSource.GLOBAL: Alignment.NONE}
RPES = [(rpe_name(pairs, distance_m), pairs, distance_m) for distance_m in RPE_DISTANCES_M for pairs in RpePairs]
OF_PATH = ('ate_rmse_m', 'ate_max_m', 'yaw_rmse_rad')
OF_SEGMENTS = ('segments', 'translation_rmse_m', 'rotation_rmse_rad')
PATH_COLUMNS = [
    *(
        f'{source.value}_{name}'
        for source in ALIGNMENTS
        for name in (*OF_PATH, *(f'{rpe}_{part}' for rpe, _, _ in RPES for part in OF_SEGMENTS))
    ),
    'true_path',
    'odom_path',
]


class RobotGeometry(NamedTuple):
    """The wheel geometry that odometry computes with."""

    wheel_diameter_m: float
    wheel_separation_m: float


class Results(NamedTuple):
    """The table of all trials, and what they have in common."""

    trials: pd.DataFrame  # see the module
    varied: List[str]  # columns of `trials`
    title: str
    notes: List[str]  # what could not be analysed and why, a line each
    manifest: Dict[str, Any]  # of a campaign; {} for bags
    folder: Optional[Path]  # of a campaign
    robot: RobotGeometry  # of the first trial, if a campaign varies it
    requested: Dict[str, Trial]  # the definition of one trial of each test


def trials_table(records: Iterable[Dict[str, Any]], varied: Sequence[str] = ()) -> pd.DataFrame:
    """Build the sorted table of all trials from a mapping of columns for each; columns left out have no value."""
    names = [name for name in header(varied) if name != 'bag']
    trials = pd.DataFrame([{'bag': '', 'true_path': None, 'odom_path': None, **each} for each in records])
    trials = trials.reindex(columns=[*names, 'bag', *PATH_COLUMNS])
    own = {part: trials[f'odom_{part}'] - trials[f'world_{part}'] for part in PARTS}
    own['yaw_rad'] = wrap_angles(own['yaw_rad'])
    trials = trials.assign(**{f'{MINUS_TRUTH}_{part}': values for part, values in own.items()})
    parameters = [varied_texts(values, varied) for values in trials[list(varied)].values.tolist()]
    trials['setup'] = [', '.join([test, *texts]) for test, texts in zip(trials['test'], parameters)]
    named = zip(trials['test'], map(ppr_text, trials['ppr']), parameters)
    trials['cell'] = [', '.join([test, encoder, *texts]) for test, encoder, texts in named]
    tests = list(dict.fromkeys([*STANDARD_TESTS, *trials['test']]))
    by_appearance = {values: rank for rank, values in enumerate(dict.fromkeys(map(tuple, parameters)))}
    order = [
        (tests.index(test), by_appearance[tuple(texts)], ppr_order(ppr), number)
        for test, texts, ppr, number in zip(trials['test'], parameters, trials['ppr'], trials['trial'])
    ]
    return trials.iloc[sorted(range(len(order)), key=order.__getitem__)].reset_index(drop=True)


def encoders(trials: pd.DataFrame) -> List[str]:
    """Return the labels of all encoders, ascending."""
    return sorted(trials['ppr'].unique(), key=ppr_order)


def varied_texts(values: Sequence[str], varied: Sequence[str]) -> List[str]:
    """Return each varied parameter with its value; the name of a variant stands alone."""
    return [value if key == VARIANT else f'{key} {value}' for key, value in zip(varied, values)]


def final_errors(trials: pd.DataFrame, pose: str, quantity: Quantity) -> np.ndarray:
    """(n,) errors of the trials that have this final pose, in the quantity's unit; `pose` is of `POSES`."""
    errors: np.ndarray = quantity.scale * trials[quantity.column(pose)].dropna().to_numpy(dtype=float)
    return errors


def record_of(row: TrialRow) -> Dict[str, Any]:
    """Return a line of trials.csv by the columns of the table; `bag` is below the campaign's folder."""
    record = {**row._asdict(), **dict(row.varied), **error_columns(row.errors), 'outcome': row.outcome.value}
    del record['varied'], record['errors']
    return record


def error_columns(errors: FinalErrors) -> Dict[str, float]:
    """Return final errors by the columns of the table."""
    return {
        f'{source.value}_{part}': value
        for source in PoseSource
        for part, value in zip(PARTS, errors.get(source) or (math.nan,) * len(PARTS))
    }


# Of more trials, some are shown one by one: the report stays below 5 MB.
MOST_SHOWN = 2000


def first_of_cells(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the first trials of each cell, equally many: `MOST_SHOWN` in all, or one of each cell.

    They have equal numbers in all cells, and are as good a sample as any: trials differ by seed only.
    """
    if len(trials) <= MOST_SHOWN:
        return trials
    return trials.groupby('cell', sort=False).head(max(1, MOST_SHOWN // trials['cell'].nunique()))


def sample_text(shown: pd.DataFrame, trials: pd.DataFrame) -> str:
    """Return which of the trials are shown; '' if all are."""
    if len(shown) == len(trials):
        return ''
    return f'The first {shown["cell"].value_counts().max()} trials of each cell, of {len(trials)}'


def equal_trials(first: pd.DataFrame, second: pd.DataFrame, pose: str) -> Tuple[pd.DataFrame, pd.DataFrame]:
    """Return number and final pose of the trials of equal number of two cells that both have it, in the same order."""
    columns = ['trial', *(f'{pose}_{part}' for part in PARTS)]
    one, other = (
        part[columns].dropna().drop_duplicates('trial', keep='last').set_index('trial', drop=False)
        for part in (first, second)
    )
    return one[one.index.isin(other.index)], other.reindex(one.index[one.index.isin(other.index)])


def are_within(trials: pd.DataFrame, pose: str, quantities: Sequence[Quantity] = QUANTITIES) -> np.ndarray:
    """(n,) of the trials that have this final pose: whether it is within the tolerances of all quantities."""
    within = [np.abs(final_errors(trials, pose, quantity)) <= quantity.tolerance for quantity in quantities]
    is_within: np.ndarray = np.all(within, axis=0)
    return is_within
