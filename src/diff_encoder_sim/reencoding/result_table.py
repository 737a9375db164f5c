"""What reencoding found, as a table for the terminal and as CSV with units in its column names."""

from __future__ import annotations

import csv
import io
import math
from typing import Dict, List, Optional, Sequence

from tabulate import tabulate

from diff_encoder_sim.encoders.pulses import ppr_label
from diff_encoder_sim.evaluation.path_error import RPE_DISTANCES_M, PathError
from diff_encoder_sim.reencoding.reencoder import WheelsAtPpr

_HEADERS = [
    'PPR',
    'reports',
    'common\nstamps',
    'ATE\n[m]',
    'max\n[m]',
    'yaw\n[deg]',
    'end x\n[m]',
    'end y\n[m]',
    'end yaw\n[deg]',
    *(f'RPE {distance_m:g} m\n[m, deg]' for distance_m in RPE_DISTANCES_M),
]


def text_table(runs: Sequence[WheelsAtPpr]) -> str:
    """One line for each PPR."""
    rows = [[ppr_label(run.ppr), run.reports, *_cells(run.comparison.error.result())] for run in runs]
    return tabulate(rows, _HEADERS, disable_numparse=True, colalign=['right'] * len(_HEADERS))


def csv_table(runs: Sequence[WheelsAtPpr]) -> str:
    """The same at full precision, angles in radians; cells without a value are empty."""
    rows = [_values(run) for run in runs]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _cells(error: Optional[PathError]) -> List[str]:
    if error is None:
        return ['-'] * (len(_HEADERS) - 2)
    degrees = math.degrees
    return [
        str(error.count),
        f'{error.position_rmse_m:.4f}',
        f'{error.position_max_m:.4f}',
        f'{degrees(error.yaw_rmse_rad):.3f}',
        f'{error.end.x_m:.4f}',
        f'{error.end.y_m:.4f}',
        f'{degrees(error.end.yaw_rad):.3f}',
        *(
            f'{relative.position_rmse_m:.4f}, {degrees(relative.yaw_rmse_rad):.3f}' if relative.count else '-'
            for relative in error.relative.values()
        ),
    ]


def _values(run: WheelsAtPpr) -> Dict[str, object]:
    error = run.comparison.error.result()
    values: Dict[str, object] = {
        'ppr': ppr_label(run.ppr),
        'reports': run.reports,
        'common_stamps': error and error.count,
        'ate_rmse_m': error and error.position_rmse_m,
        'ate_max_m': error and error.position_max_m,
        'yaw_rmse_rad': error and error.yaw_rmse_rad,
        'end_x_m': error and error.end.x_m,
        'end_y_m': error and error.end.y_m,
        'end_yaw_rad': error and error.end.yaw_rad,
        'reference_length_m': error and error.length_m,
    }
    for distance_m in RPE_DISTANCES_M:
        relative = error.relative[distance_m] if error else None
        is_known = relative is not None and relative.count > 0
        name = f'rpe_{distance_m:g}m'
        values[f'{name}_position_rmse_m'] = relative.position_rmse_m if is_known else None
        values[f'{name}_yaw_rmse_rad'] = relative.yaw_rmse_rad if is_known else None
    return values
