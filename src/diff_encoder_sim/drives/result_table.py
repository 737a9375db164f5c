"""Errors of each reencoded odometry: tables for the terminal, and CSV with units in its column names."""

from __future__ import annotations

import csv
import io
import math
from typing import Dict, List, Optional, Sequence, Union

from tabulate import tabulate

from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, PathError, RelativeError, RpePairs, rpe_name
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr

_PATH_HEADS = [
    'PPR',
    'reports',
    'common\nstamps',
    'ATE\n[m]',
    'max\n[m]',
    'yaw\n[deg]',
    'end x\n[m]',
    'end y\n[m]',
    'end yaw\n[deg]',
]
_RPE_HEADS = [
    'PPR',
    'segment\nlength',
    *(head for pairs in RpePairs for head in (f'{pairs.text}\nsegments', 'RPE\n[m]', 'RPE\n[deg]')),
]

Value = Union[str, int, float, None]


def text_table(runs: Sequence[WheelsAtPpr]) -> str:
    """Format one line for each encoder, and one for each encoder and length of RPE's segments."""
    errors = {run.label: run.comparison.result() for run in runs}
    paths = [[run.label, run.reports, *_path_cells(errors[run.label])] for run in runs]
    relative = [
        [label, f'{distance_m:g} m', *(cell for pairs in RpePairs for cell in _rpe_cells(error.rpe[pairs][distance_m]))]
        for label, error in errors.items()
        if error
        for distance_m in RPE_DISTANCES_M
    ]
    return '\n\n'.join(_table(rows, heads) for rows, heads in ((paths, _PATH_HEADS), (relative, _RPE_HEADS)) if rows)


def csv_table(runs: Sequence[WheelsAtPpr]) -> str:
    """Format the same at full precision, angles in radians; cells without a value are empty."""
    rows = [_values(run) for run in runs]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _table(rows: Sequence[Sequence[object]], heads: List[str]) -> str:
    return tabulate(rows, heads, disable_numparse=True, colalign=['right'] * len(heads))


def _path_cells(error: Optional[PathError]) -> List[str]:
    if error is None:
        return ['-'] * (len(_PATH_HEADS) - 2)
    degrees = math.degrees
    return [
        str(error.poses),
        f'{error.ate_rmse_m:.4f}',
        f'{error.ate_max_m:.4f}',
        f'{degrees(error.yaw_rmse_rad):.3f}',
        f'{error.end.x_m:.4f}',
        f'{error.end.y_m:.4f}',
        f'{degrees(error.end.yaw_rad):.3f}',
    ]


def _rpe_cells(error: RelativeError) -> List[str]:
    if not error.segments:
        return ['0', '-', '-']
    rotation_deg = math.degrees(error.rotation_rmse_rad)
    return [str(error.segments), f'{error.translation_rmse_m:.4f}', f'{rotation_deg:.3f}']


def _values(run: WheelsAtPpr) -> Dict[str, Value]:
    error = run.comparison.result()
    values: Dict[str, Value] = {'ppr': run.label, 'reports': run.reports}
    values['common_stamps'] = error and error.poses
    values['ate_rmse_m'] = error and error.ate_rmse_m
    values['ate_max_m'] = error and error.ate_max_m
    values['yaw_rmse_rad'] = error and error.yaw_rmse_rad
    values['end_x_m'] = error and error.end.x_m
    values['end_y_m'] = error and error.end.y_m
    values['end_yaw_rad'] = error and error.end.yaw_rad
    values['reference_length_m'] = error and error.length_m
    for distance_m in RPE_DISTANCES_M:
        for pairs in RpePairs:
            values.update(_rpe_values(rpe_name(pairs, distance_m), error and error.rpe[pairs][distance_m]))
    return values


def _rpe_values(name: str, error: Optional[RelativeError]) -> Dict[str, Value]:
    known = error if error and error.segments else None
    return {
        f'{name}_position_rmse_m': known and known.translation_rmse_m,
        f'{name}_yaw_rmse_rad': known and known.rotation_rmse_rad,
        f'{name}_segments': error and error.segments,
    }
