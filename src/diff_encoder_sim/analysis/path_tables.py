"""The table of errors over the whole path: absolute (ATE), and relative by distance (RPE)."""

from __future__ import annotations

import math
from typing import Callable, List, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.final_errors import with_final_error
from diff_encoder_sim.analysis.table_files import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys
from diff_encoder_sim.evaluation.path_errors import RPE_DISTANCES_M, PathErrors
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, mean_interval, spread
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE

DECIMALS_M, DECIMALS_DEG = 4, 3

_WHOLE = 'whole path'


def path_error_table(dataset: Dataset) -> Optional[Table]:
    """Rows cell and source, numbers over its trials; None for a dataset without paths."""
    keys = varied_keys(dataset)
    columns = [
        *key_columns(keys),
        Column('ppr', 'PPR'),
        Column('source', 'source'),
        Column('trials', 'trials'),
        *_columns(),
    ]
    rows: List[List[Entry]] = []
    for cell, trials in dataset.cells().items():
        for source, topic in TOPIC_OF_SOURCE.items():
            paths = [path for path in (trial.paths.get(source) for trial in with_final_error(trials, source)) if path]
            if paths:
                rows.append(
                    [*key_entries(cell.test, cell.varied, keys), cell.ppr, Label(source.value, topic), *_numbers(paths)]
                )
    if not rows:
        return None
    return Table(
        'path_errors',
        'Errors over the whole path',
        columns,
        rows,
        [
            "ATE: distance from the truth, without alignment; mean of the trials' RMSE with its "
            f'{100 * LEVEL:g} % interval (t-distribution) and standard deviation, and the largest '
            'distance in any trial. RPE: error of the motion over stretches of the true path; mean of '
            'the RMSE of those trials whose path is so long. inf: too few trials for a bound.'
        ],
    )


def _columns() -> List[Column]:
    columns = [
        Column('ate_rmse_mean_m', 'ATE RMSE [m]', _WHOLE),
        Column('ate_rmse_low_m', 'from', _WHOLE),
        Column('ate_rmse_high_m', 'to', _WHOLE),
        Column('ate_rmse_std_m', 'std. dev.', _WHOLE),
        Column('ate_max_m', 'ATE max [m]', _WHOLE),
        Column('yaw_rmse_mean_deg', 'yaw RMSE [deg]', _WHOLE),
    ]
    for distance_m in RPE_DISTANCES_M:
        name, group = f'rpe_{distance_m:g}m', f'RPE RMSE over {distance_m:g} m'
        columns += [
            Column(f'{name}_translation_rmse_mean_m', 'translation [m]', group),
            Column(f'{name}_rotation_rmse_mean_deg', 'rotation [deg]', group),
        ]
    return columns


def _numbers(paths: Sequence[PathErrors]) -> List[Entry]:
    """Count, and an entry for each of `_columns`."""
    ate_m = np.array([path.ate_rmse_m for path in paths])
    in_metres = [
        _mean(paths, lambda path: path.ate_rmse_m),
        *mean_interval(ate_m, LEVEL),
        spread(ate_m),
        max(path.ate_max_m for path in paths),
    ]
    numbers = [
        Number(len(paths), 0),
        *(Number(value, DECIMALS_M) for value in in_metres),
        Number(_mean(paths, lambda path: math.degrees(path.yaw_rmse_rad)), DECIMALS_DEG),
    ]
    for distance_m in RPE_DISTANCES_M:
        numbers += _relative_numbers([path for path in paths if distance_m in path.rpe], distance_m)
    return numbers


def _relative_numbers(paths: Sequence[PathErrors], distance_m: float) -> List[Number]:
    return [
        Number(_mean(paths, lambda path: path.rpe[distance_m].translation_rmse_m), DECIMALS_M),
        Number(_mean(paths, lambda path: math.degrees(path.rpe[distance_m].rotation_rmse_rad)), DECIMALS_DEG),
    ]


def _mean(paths: Sequence[PathErrors], value: Callable[[PathErrors], float]) -> Optional[float]:
    return float(np.mean([value(path) for path in paths])) if paths else None
