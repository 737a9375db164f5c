"""The spread of the odometry's error: what quantisation alone explains, beside what was measured."""

from __future__ import annotations

import math
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.closed_form import closed_form_std, heading_std_rad, odometry_minus_truth, wheel_travel_m
from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.dataset import Dataset, RobotGeometry, TrialData
from diff_encoder_sim.analysis.encoder_labels import ppr_value
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW
from diff_encoder_sim.analysis.sample_statistics import spread, std_interval
from diff_encoder_sim.analysis.table import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import cell_text
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Trial

# Standard deviations range over three decades: in millimetres they are easier to read.
SCALED = {'m': ('mm', 1e3), 'deg': ('deg', 1.0)}
DIGITS = 3

_GROUP = 'standard deviation'
_COLUMNS = [
    Column('cell', 'cell'),
    Column('quantity', 'error'),
    Column('at_goal', 'quantisation alone, exactly at the goal', _GROUP),
    Column('expected', 'quantisation alone, where trials stop', _GROUP),
    Column('measured', 'measured (95 % interval)', _GROUP),
    Column('conclusion', 'measured is', _GROUP),
]
_NOTES = [
    (
        'Closed form: wheel phases uniform at the start. Larger measured values come from slip, wheel errors and the '
        'true final pose.'
    ),
    (
        'Heading after one straight line, or turns in place, by wheels that travel k + f pulses (d: travel per pulse, '
        'L: separation): (d/L) sqrt(2 f (1 - f)), for f exactly at the goal, and averaged over where the trials truly '
        'stopped. Where their stops differ by several pulses, and for all other numbers, the average over f: '
        '(d/L) sqrt(1/3) for the heading.'
    ),
]


def closed_form_table(dataset: Dataset) -> Optional[Table]:
    """Build rows of cell and quantity; None where no cell has both numbers."""
    rows = list(_rows(dataset))
    title = 'Final /odom minus /world_pose: closed form and measured'
    return Table('closed_form', title, _COLUMNS, rows, _NOTES) if rows else None


def _rows(dataset: Dataset) -> Iterator[List[Entry]]:
    for cell, trials in dataset.cells().items():
        ppr = ppr_value(cell.ppr)
        if ppr is None or cell.test not in dataset.requested:
            continue
        requested = dataset.requested[cell.test]
        averaged = closed_form_std(requested, dataset.robot, ppr)
        for quantity in QUANTITIES:
            unit, scale = SCALED[quantity.unit]
            values = scale * odometry_minus_truth(trials, quantity)
            if len(values) > 1:
                expected: Tuple[Optional[float], float] = (None, float(averaged[quantity.component]))
                if quantity is YAW:
                    expected = _heading_stds(requested, dataset.robot, ppr, trials) or expected
                at_goal, where_stopped = (std and scale * quantity.scale * std for std in expected)
                texts = [_text(at_goal), *_comparison(values, where_stopped or 0.0)]
                yield [cell_text(cell), f'{quantity.axis} [{unit}]', *texts]


def _heading_stds(
    requested: Trial, robot: RobotGeometry, ppr: float, trials: Sequence[TrialData]
) -> Optional[Tuple[float, float]]:
    """Return the closed form [rad] exactly at the goal, and where the trials stopped; None for a drive without one."""
    errors = (trial.errors[PoseSource.WORLD] for trial in trials if trial.odometry_minus_truth is not None)
    stops = [error for error in errors if error is not None]
    m_per_pulse = math.pi * robot.wheel_diameter_m / ppr
    travels = [wheel_travel_m(requested, robot, ends) for ends in ([Pose2D(0.0, 0.0, 0.0)], stops)]
    at_goal, stopped = (
        travel if travel is None else heading_std_rad(travel, m_per_pulse, robot.wheel_separation_m)
        for travel in travels
    )
    return None if at_goal is None or stopped is None else (at_goal, stopped)


def _comparison(values: np.ndarray, expected: float) -> Tuple[str, str, str]:
    """Return the last three columns of the group."""
    low, high = std_interval(values, LEVEL)
    conclusion = 'above' if low > expected else 'below' if high < expected else 'as expected'
    measured = f'{spread(values) or 0.0:.{DIGITS}g} ({low:.{DIGITS}g} to {high:.{DIGITS}g})'
    return _text(expected), measured, conclusion


def _text(std: Optional[float]) -> str:
    return '–' if std is None else f'{std:.{DIGITS}g}'
