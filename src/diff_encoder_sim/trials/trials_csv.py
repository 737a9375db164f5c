"""trials.csv: its columns, the row of a finished trial, and the file; names of other files of a results folder."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, NamedTuple, Sequence, Tuple, get_type_hints

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome

MANIFEST, TABLE, BAGS = 'manifest.json', 'trials.csv', 'bags'
VARIANT = 'variant'  # in place of the key of a varied parameter: the value is the name of a set of values


class TrialRow(NamedTuple):
    """A finished trial, by columns of trials.csv; `varied` and `errors` are several columns."""

    test: str
    ppr: str  # as encoder_params.ppr_label writes it
    varied: Tuple[Tuple[str, str], ...]  # dotted keys of parameters, and their values as text
    trial: int
    seed: int
    outcome: Outcome  # one of OUTCOMES
    reason: str  # of any outcome except SUCCEEDED
    duration_s: float  # simulated
    errors: FinalErrors
    distance_m: float  # length of the true path
    wall_time_s: float = 0.0
    bag: str = ''  # path below the results folder; '' for none

    def identity(self) -> Tuple[object, ...]:
        """Return the first fields, up to the seed, which identify the trial."""
        return self[:5]


PARTS = ('x_m', 'y_m', 'yaw_rad')  # of a final error, in the map's axes
# Lockstep trials have no ROS graph that can fail; trials without a result have no row.
OUTCOMES = tuple(outcome for outcome in Outcome if outcome not in (Outcome.FAILED, Outcome.TORN))
_KINDS = get_type_hints(TrialRow)


def header(varied_keys: Sequence[str]) -> List[str]:
    """Return the names of the columns; those of an error are empty without a pose."""
    errors = [f'{source.value}_{part}' for source in PoseSource for part in PARTS]
    several = {'varied': list(varied_keys), 'errors': errors}
    return [name for field in TrialRow._fields for name in several.get(field, [field])]


def line_of(row: TrialRow) -> bytes:
    """Return the row as a line of the file; numbers read back as the same numbers, wall time to the millisecond."""
    texts = {**row._asdict(), **dict(row.varied), 'outcome': row.outcome.value}
    texts['wall_time_s'] = round(row.wall_time_s, 3)
    texts['reason'] = ''.join(char if char.isprintable() else ' ' for char in row.reason)  # a row is one line
    for source, error in row.errors.items():
        texts.update((f'{source.value}_{part}', value) for part, value in zip(PARTS, error or ()))
    line = io.StringIO()
    names = header([key for key, _ in row.varied])
    csv.DictWriter(line, names, extrasaction='ignore', lineterminator='\n').writerow(texts)
    return line.getvalue().encode('utf-8')


def row_of(line: bytes, varied_keys: Sequence[str]) -> TrialRow:
    """Return the row of a line of `line_of`, with or without its end; ValueError or csv.Error if it is none."""
    names, fields = header(varied_keys), next(csv.reader([line.decode('utf-8')], strict=True))
    if len(fields) != len(names):
        raise ValueError(f'{len(fields)} fields; expected {len(names)}')
    texts = dict(zip(names, fields))
    errors: FinalErrors = {}
    for source in PoseSource:
        parts = [texts[f'{source.value}_{part}'] for part in PARTS]
        errors[source] = Pose2D(*map(float, parts)) if any(parts) else None
    values: Dict[str, Any] = {name: _KINDS[name](texts[name]) for name in TrialRow._fields if name in texts}
    numbers = [value for value in values.values() if isinstance(value, float)]
    if not all(map(math.isfinite, numbers + [part for error in errors.values() for part in error or ()])):
        raise ValueError('a number is not finite')  # it would make the statistics of its cell NaN
    if values['outcome'] not in OUTCOMES:
        raise ValueError(f'outcome {texts["outcome"]}')
    return TrialRow(**values, varied=tuple((key, texts[key]) for key in varied_keys), errors=errors)


def table_of(rows: Iterable[TrialRow], varied_keys: Sequence[str]) -> bytes:
    """Return the content of the file."""
    return f'{",".join(header(varied_keys))}\n'.encode() + b''.join(map(line_of, rows))


def read_rows(path: Path, varied_keys: Sequence[str], belongs: Callable[[TrialRow], bool]) -> Iterator[TrialRow]:
    """Read the complete lines of the file, if it exists; ConfigError if a row does not belong to the campaign."""
    content = path.read_bytes() if path.is_file() else b''
    for number, line in enumerate(content[: content.rfind(b'\n') + 1].splitlines(keepends=True), start=1):
        if number > 1 or line != table_of((), varied_keys):
            try:
                row = row_of(line, varied_keys)
            except (ValueError, csv.Error):
                row = None
            if row is None or not belongs(row):
                expected = 'expected the file as campaign wrote it, or without this line, whose trial is then run again'
                raise ConfigError(f'{path}: line {number} does not belong to this campaign; {expected}')
            yield row
