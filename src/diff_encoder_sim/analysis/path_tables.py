"""The table of errors over the whole path: absolute (ATE), and relative by distance (RPE)."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.final_errors import with_final_error
from diff_encoder_sim.analysis.sample_statistics import mean_interval, spread
from diff_encoder_sim.analysis.table import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, PathError, RelativeError, RpePairs, rpe_name

DECIMALS_M, DECIMALS_DEG = 4, 3

_WHOLE = 'whole path'
_RPE = [(pairs, distance_m) for distance_m in RPE_DISTANCES_M for pairs in RpePairs]


_ATE_NOTE = (
    "ATE: distance from the true pose, /odom's with its first pose aligned to the true one, the others' without "
    f"alignment; mean of the trials' RMSE with its {100 * LEVEL:g} % interval (t-distribution) and standard deviation, "
    'and the largest distance in any trial. inf: too few trials for a bound.'
)
_RPE_NOTE = (
    'RPE: error of the motion over segments of the true path; mean of the RMSE of the trials whose path is so long, '
    'and how many segments they have together. Consecutive segments lie end to end; of all pairs, one begins at each '
    'pose.'
)


def path_error_table(dataset: Dataset) -> Optional[Table]:
    """Build a row for each cell and source over its trials; None for a dataset without paths."""
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = []
    for cell, trials in dataset.cells().items():
        for source, topic in TOPIC_OF_SOURCE.items():
            paths = [path for path in (trial.paths.get(source) for trial in with_final_error(trials, source)) if path]
            if paths:
                entries: List[Entry] = [
                    *key_entries(cell.test, cell.varied, keys),
                    cell.ppr,
                    Label(source.value, topic),
                ]
                rows.append([*entries, *_numbers(paths)])
    if not rows:
        return None
    columns = [*key_columns(keys), *_columns()]
    return Table('path_errors', 'Errors over the whole path', columns, rows, [_ATE_NOTE, _RPE_NOTE])


def _columns() -> List[Column]:
    columns = [
        Column('ppr', 'PPR'),
        Column('source', 'source'),
        Column('trials', 'trials'),
        Column('ate_rmse_mean_m', 'ATE RMSE [m]', _WHOLE),
        Column('ate_rmse_low_m', 'from', _WHOLE),
        Column('ate_rmse_high_m', 'to', _WHOLE),
        Column('ate_rmse_std_m', 'std. dev.', _WHOLE),
        Column('ate_max_m', 'ATE max [m]', _WHOLE),
        Column('yaw_rmse_mean_deg', 'yaw RMSE [deg]', _WHOLE),
    ]
    return columns + [column for pairs, distance_m in _RPE for column in _rpe_columns(pairs, distance_m)]


def _rpe_columns(pairs: RpePairs, distance_m: float) -> List[Column]:
    name, group = rpe_name(pairs, distance_m), f'RPE over {distance_m:g} m, {pairs.text}'
    return [
        Column(f'{name}_segments', 'segments', group),
        Column(f'{name}_translation_rmse_mean_m', 'translation [m]', group),
        Column(f'{name}_rotation_rmse_mean_deg', 'rotation [deg]', group),
    ]


def _numbers(paths: Sequence[PathError]) -> List[Entry]:
    """Return an entry for each of `_columns` from the number of trials on."""
    ate_m = np.array([path.ate_rmse_m for path in paths])
    in_metres = [
        _mean(ate_m.tolist()),
        *mean_interval(ate_m, LEVEL),
        spread(ate_m),
        max(path.ate_max_m for path in paths),
    ]
    numbers: List[Entry] = [
        Number(len(paths), 0),
        *(Number(value, DECIMALS_M) for value in in_metres),
        Number(_mean([math.degrees(path.yaw_rmse_rad) for path in paths]), DECIMALS_DEG),
    ]
    for pairs, distance_m in _RPE:
        numbers += _relative_numbers([path.rpe[pairs][distance_m] for path in paths])
    return numbers


def _relative_numbers(errors: Sequence[RelativeError]) -> List[Entry]:
    known = [error for error in errors if error.segments]
    return [
        Number(sum(error.segments for error in known), 0),
        Number(_mean([error.translation_rmse_m for error in known]), DECIMALS_M),
        Number(_mean([math.degrees(error.rotation_rmse_rad) for error in known]), DECIMALS_DEG),
    ]


def _mean(values: Sequence[float]) -> Optional[float]:
    return float(np.mean(values)) if values else None
