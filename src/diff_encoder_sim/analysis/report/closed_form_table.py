"""What whole pulses alone explain of the odometry's error, beside what was measured."""

from __future__ import annotations

from typing import List, Optional

import numpy as np

from diff_encoder_sim.analysis.closed_form import closed_form_std, odometry_minus_truth
from diff_encoder_sim.analysis.dataset import Dataset, ppr_value
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.table_files import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import cell_head
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, spread, std_interval

# Spreads run over three decades: few millimetres are many.
SCALED = {'m': ('mm', 1e3), 'deg': ('deg', 1.0)}
DIGITS = 3


def closed_form_table(dataset: Dataset) -> Optional[Table]:
    """Rows cell and axis; None where no cell has both numbers."""
    rows: List[List[Entry]] = []
    for cell, trials in dataset.cells().items():
        ppr = ppr_value(cell.ppr)
        if ppr is None or cell.test not in dataset.asked:
            continue
        expected = closed_form_std(dataset.asked[cell.test], dataset.robot, ppr)
        for quantity in QUANTITIES:
            values = odometry_minus_truth(trials, quantity)
            if len(values) > 1:
                unit, scale = SCALED[quantity.unit]
                rows.append(
                    _row(
                        cell_head(cell),
                        f'{quantity.axis} [{unit}]',
                        scale * values,
                        scale * quantity.scale * expected[quantity.component],
                    )
                )
    if not rows:
        return None
    columns = [
        Column('cell', 'cell'),
        Column('quantity', 'error'),
        Column('expected', 'whole pulses alone', 'standard deviation'),
        Column('measured', 'measured (95 % interval)', 'standard deviation'),
        Column('verdict', 'measured is', 'standard deviation'),
    ]
    return Table(
        'closed_form',
        'Final /odom minus /world_pose: closed form and measured',
        columns,
        rows,
        [
            'Closed form: wheel phases uniform at the start and the goal reached '
            'exactly. What lies above it comes from slip, wheel errors and where the '
            'robot really stood. Where a test turns by a whole number of pulses, the '
            'measured spread of the heading lies below.'
        ],
    )


def _row(cell: str, error: str, values: np.ndarray, expected: float) -> List[Entry]:
    interval = std_interval(values, LEVEL)
    verdict = 'as expected'
    if interval.low > expected:
        verdict = 'above'
    elif interval.high < expected:
        verdict = 'below'
    return [
        cell,
        error,
        _digits(expected),
        f'{_digits(spread(values))} ({_digits(interval.low)} to {_digits(interval.high)})',
        verdict,
    ]


def _digits(value: float) -> str:
    return f'{value:.{DIGITS}g}'
