"""Results of trials as one table, the input of all statistics, tables, figures and reports.

`Results.trials` is a pandas DataFrame with a row per trial: the tests of the paper first, then by varied parameters in
order of appearance, encoders ascending, trials by number. The index counts from 0. Columns:

- `test`, `ppr`: name of the test, label of the encoder.
- one for each of `Results.varied`: value of a varied parameter, as text; `variant` is the name of a set of values.
- `trial`, `seed`: number of the trial; trials of equal number in different cells have equal random draws (pairs).
- `outcome`, `reason`: value of `Outcome`; reason of a failure.
- `duration_s`, `distance_m`, `wall_time_s`: simulated time, length of the true path, time to compute (NaN for bags).
- `odom_x_m`, `odom_y_m`, `odom_yaw_rad`: final /odom minus the goal along the map's axes; NaN without one, or if torn.
- `amcl_*`, `global_*`, `world_*`: the same of /amcl_pose, /global_pose, /world_pose.
- `odom_minus_world_*`: final /odom minus final /world_pose: the odometry error.
- `bag`: path of the bag, as text; '' if there is none or it cannot be read.
- `setup`: test with its varied parameters, as in tables: `SL, noise 0.03`.
- `cell`: setup with the encoder: `SL, 90 counts, noise 0.03`; trials of a cell differ only in their seed.
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

STANDARD_TESTS = ('SL', 'SMT', 'DLD')  # of the paper, first in every table
MOST_POINTS = 600  # of a path
SUCCEEDED = Outcome.SUCCEEDED.value

# Odometry starts at an arbitrary pose; the other sources estimate the pose in the map.
ALIGNMENTS = {PoseSource.ODOM: Alignment.ORIGIN, PoseSource.AMCL: Alignment.NONE, PoseSource.GLOBAL: Alignment.NONE}
RPES = [(rpe_name(pairs, distance_m), pairs, distance_m) for distance_m in RPE_DISTANCES_M for pairs in RpePairs]
OF_PATH = ('ate_rmse_m', 'ate_max_m', 'yaw_rmse_rad')
OF_SEGMENTS = ('segments', 'translation_rmse_m', 'rotation_rmse_rad')
_ERRORS = [*OF_PATH, *(f'{rpe}_{part}' for rpe, _, _ in RPES for part in OF_SEGMENTS)]
PATH_COLUMNS = [*(f'{source.value}_{name}' for source in ALIGNMENTS for name in _ERRORS), 'true_path', 'odom_path']


class RobotGeometry(NamedTuple):
    """Wheel geometry of odometry."""

    wheel_diameter_m: float
    wheel_separation_m: float


class Results(NamedTuple):
    """Table of all trials with common data."""

    trials: pd.DataFrame  # see the module's docstring
    varied: List[str]  # columns of `trials`
    title: str
    notes: List[str]  # one line per item that was not analysed
    manifest: Dict[str, Any]  # of a campaign; {} for bags
    folder: Optional[Path]  # of a campaign
    robot: RobotGeometry  # of the first trial, if a campaign varies it
    requested: Dict[str, Trial]  # definition of one trial per test


def trials_table(records: Iterable[Dict[str, Any]], varied: Sequence[str] = ()) -> pd.DataFrame:
    """Build the sorted table of trials from one mapping of columns per trial; missing columns have no value."""
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
    by_appearance = pd.factorize(np.array([', '.join(texts) for texts in parameters]))[0]
    ranks = trials['test'].map(tests.index), by_appearance, trials['ppr'].map(encoders(trials).index), trials['trial']
    return trials.iloc[np.lexsort(ranks[::-1])].reset_index(drop=True)


def encoders(trials: pd.DataFrame) -> List[str]:
    """Return the labels of all encoders, ascending."""
    return sorted(trials['ppr'].unique(), key=ppr_order)


def varied_texts(values: Sequence[str], varied: Sequence[str]) -> List[str]:
    """Return each varied parameter with its value; for a variant only its name."""
    return [value if key == VARIANT else f'{key} {value}' for key, value in zip(varied, values)]


def campaign_names(results: Results, name: str) -> List[str]:
    """Return for each trial the name of its campaign in comparisons: a name with the varied parameters."""
    values = results.trials[results.varied].values.tolist()
    return [', '.join(filter(None, [name, *varied_texts(each, results.varied)])) for each in values]


def final_errors(trials: pd.DataFrame, pose: str, quantity: Quantity) -> np.ndarray:
    """Return the (n,) errors of trials with this final pose (a key of `POSES`), in the quantity's unit."""
    return np.asarray(quantity.scale * trials[quantity.column(pose)].dropna().to_numpy(dtype=float))


def record_of(row: TrialRow) -> Dict[str, Any]:
    """Return a line of trials.csv by column of the table; `bag` is relative to the campaign's folder."""
    fields = row._asdict()
    varied, errors = fields.pop('varied'), fields.pop('errors')
    return {**fields, **dict(varied), **error_columns(errors), 'outcome': row.outcome.value}


def error_columns(errors: FinalErrors) -> Dict[str, float]:
    """Return final errors by column of the table."""
    return {
        f'{source.value}_{part}': value
        for source in PoseSource
        for part, value in zip(PARTS, errors.get(source) or (math.nan,) * len(PARTS))
    }


MOST_SHOWN = 2000  # trials one by one, which keeps the report below 5 MB


def first_of_cells(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the first trials of each cell, equally many per cell: at most `MOST_SHOWN`, at least one per cell."""
    if len(trials) <= MOST_SHOWN:
        return trials
    return trials.groupby('cell', sort=False).head(max(1, MOST_SHOWN // trials['cell'].nunique()))


def sample_text(shown: pd.DataFrame, trials: pd.DataFrame) -> str:
    """Return a text about the shown trials; '' if all are shown."""
    if len(shown) == len(trials):
        return ''
    return f'The first {shown["cell"].value_counts().max()} trials of each cell, of {len(trials)}'


def equal_trials(first: pd.DataFrame, second: pd.DataFrame, pose: str) -> Tuple[pd.DataFrame, pd.DataFrame]:
    """Return number and final pose of the equal trials of two cells, in the same order."""
    columns = ['trial', *(f'{pose}_{part}' for part in PARTS)]
    one, other = (
        part[columns].dropna().drop_duplicates('trial', keep='last').set_index('trial', drop=False)
        for part in (first, second)
    )
    return one[one.index.isin(other.index)], other.reindex(one.index[one.index.isin(other.index)])


def are_within(trials: pd.DataFrame, pose: str, quantities: Sequence[Quantity] = QUANTITIES) -> np.ndarray:
    """Return for the (n,) trials with this final pose whether it is within the tolerances of all quantities."""
    within = [np.abs(final_errors(trials, pose, quantity)) <= quantity.tolerance for quantity in quantities]
    return np.asarray(np.all(within, axis=0))
