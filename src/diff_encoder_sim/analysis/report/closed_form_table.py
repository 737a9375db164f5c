"""The spread of the odometry's error: what quantisation alone explains, beside what was measured."""

from __future__ import annotations

from typing import Iterator, List, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.closed_form import closed_form_std, odometry_minus_truth
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_value
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.table import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import cell_text
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, spread, std_interval

# Standard deviations range over three decades: in millimetres they are easier to read.
SCALED = {'m': ('mm', 1e3), 'deg': ('deg', 1.0)}
DIGITS = 3

_GROUP = 'standard deviation'
_COLUMNS = [
    Column('cell', 'cell'),
    Column('quantity', 'error'),
    Column('expected', 'quantisation alone', _GROUP),
    Column('measured', 'measured (95 % interval)', _GROUP),
    Column('conclusion', 'measured is', _GROUP),
]
_NOTE = (
    'Closed form: wheel phases uniform at the start and the goal reached exactly. Larger measured values come from '
    'slip, wheel errors and the true final pose. Where a test turns by a whole number of pulses, the measured '
    'standard deviation of the heading is smaller.'
)


def closed_form_table(dataset: Dataset) -> Optional[Table]:
    """Build rows of cell and quantity; None where no cell has both numbers."""
    rows = list(_rows(dataset))
    title = 'Final /odom minus /world_pose: closed form and measured'
    return Table('closed_form', title, _COLUMNS, rows, [_NOTE]) if rows else None


def _rows(dataset: Dataset) -> Iterator[List[Entry]]:
    for cell, trials in dataset.cells().items():
        ppr = ppr_value(cell.ppr)
        if ppr is None or cell.test not in dataset.requested:
            continue
        expected = closed_form_std(dataset.requested[cell.test], dataset.robot, ppr)
        for quantity in QUANTITIES:
            unit, scale = SCALED[quantity.unit]
            values = scale * odometry_minus_truth(trials, quantity)
            if len(values) > 1:
                expected_std = scale * quantity.scale * expected[quantity.component]
                yield [cell_text(cell), f'{quantity.axis} [{unit}]', *_comparison(values, expected_std)]


def _comparison(values: np.ndarray, expected: float) -> Tuple[str, str, str]:
    """Return an entry for each column of the group."""
    low, high = std_interval(values, LEVEL)
    conclusion = 'above' if low > expected else 'below' if high < expected else 'as expected'
    measured = f'{spread(values) or 0.0:.{DIGITS}g} ({low:.{DIGITS}g} to {high:.{DIGITS}g})'
    return f'{expected:.{DIGITS}g}', measured, conclusion
