"""One trial's result: a row of trials.csv, which the csv module, pandas and spreadsheets read."""

from __future__ import annotations

import csv
import io
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.csv_cells import text_cell, text_of_cell
from diff_encoder_sim.base.plain_numbers import plain_float, plain_int
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.pose_source import PoseSource
from diff_encoder_sim.drives.trial_outcome import FinalErrors, Outcome

PARTS = ('x_m', 'y_m', 'yaw_rad')

# A lockstep trial has no ROS graph that fails, and a trial without a result has no row.
OUTCOMES = tuple(outcome for outcome in Outcome if outcome not in (Outcome.FAILED, Outcome.TORN))


class TrialRow(NamedTuple):
    """A trial and how it ended."""

    test: str
    ppr: str  # as encoders.pulses.ppr_label writes it
    varied: Tuple[Tuple[str, str], ...]  # dotted keys of parameters, and their values as text
    trial: int
    seed: int
    outcome: Outcome  # one of OUTCOMES
    reason: str  # of any but succeeded
    duration_s: float  # simulated
    errors: FinalErrors
    distance_m: float  # length of the true path
    wall_time_s: float
    bag: str  # path below the results folder; '' for none

    def identity(self) -> Tuple[object, ...]:
        """Return what identifies the trial: the first fields, up to the seed."""
        return self[:5]


def header(varied_keys: Sequence[str]) -> List[str]:
    """Return the names of the columns, with their units."""
    return [
        'test',
        'ppr',
        *varied_keys,
        'trial',
        'seed',
        'outcome',
        'reason',
        'duration_s',
        *(f'{source.value}_{part}' for source in PoseSource for part in PARTS),
        'distance_m',
        'wall_time_s',
        'bag',
    ]


def fields_of(row: TrialRow) -> List[str]:
    """Return the row as texts; numbers read back as the same numbers, wall time to the millisecond."""
    errors = [row.errors.get(source) or ('',) * len(PARTS) for source in PoseSource]
    values = [
        row.test,
        row.ppr,
        *(text for _, text in row.varied),
        row.trial,
        row.seed,
        row.outcome.value,
        _one_line(row.reason),
        float(row.duration_s),
        *(part if part == '' else float(part) for error in errors for part in error),
        float(row.distance_m),
        round(float(row.wall_time_s), 3),
        row.bag,
    ]
    return [value if isinstance(value, str) else repr(value) for value in values]


def row_of(fields: Sequence[str], varied_keys: Sequence[str]) -> TrialRow:
    """Return the row that `fields_of` made into texts.

    Raises:
        ValueError: these are not the fields of a row.
    """
    names = header(varied_keys)
    if len(fields) != len(names):
        raise ValueError(f'{len(fields)} fields; expected {len(names)}')
    by_name = dict(zip(names, fields))
    return TrialRow(
        by_name['test'],
        by_name['ppr'],
        tuple((key, by_name[key]) for key in varied_keys),
        plain_int(by_name['trial']),
        plain_int(by_name['seed']),
        _outcome(by_name['outcome']),
        by_name['reason'],
        plain_float(by_name['duration_s']),
        {source: _error(by_name, source) for source in PoseSource},
        plain_float(by_name['distance_m']),
        plain_float(by_name['wall_time_s']),
        by_name['bag'],
    )


def csv_line(fields: Sequence[str]) -> bytes:
    """One line of a CSV file, its end included."""
    text = io.StringIO()
    csv.writer(text, lineterminator='\n').writerow(map(text_cell, fields))
    return text.getvalue().encode('utf-8')


def csv_fields(line: bytes) -> List[str]:
    """Return the fields that `csv_line` made into a line, with or without its end.

    Raises:
        ValueError: this is no such line.
    """
    try:
        return [text_of_cell(cell) for cell in next(csv.reader([line.decode('utf-8')], strict=True))]
    except csv.Error as error:
        raise ValueError(str(error)) from None


def _one_line(text: str) -> str:
    """Return a text without line ends: a row is one line of the file."""
    return ''.join(char if char.isprintable() else ' ' for char in text)


def _outcome(text: str) -> Outcome:
    for outcome in OUTCOMES:
        if outcome.value == text:
            return outcome
    raise ValueError(f'outcome {text!r}; expected {", ".join(outcome.value for outcome in OUTCOMES)}')


def _error(by_name: Dict[str, str], source: PoseSource) -> Optional[Pose2D]:
    texts = [by_name[f'{source.value}_{part}'] for part in PARTS]
    if texts == [''] * len(PARTS):
        return None
    return Pose2D(*map(plain_float, texts))
