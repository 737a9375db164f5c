"""Wheel angles from a table in a text file: how it is written, and its rows."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import struct
from decimal import Decimal
from pathlib import Path
from typing import Collection, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import LATEST_NS
from diff_encoder_sim.drives.number_units import TIME_UNITS
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.wheel_source import TimedDrive, WheelNumbers, WheelUnit, paired_drives, wheel_angles
from diff_encoder_sim.wheels.encoder_params import PerWheel

COMMENT = '#'
COLUMNS = 3  # time, left, right

# The first that gives enough columns; None stands for any spaces. A comma may also be a decimal sign.
_DELIMITERS: Tuple[Optional[str], ...] = (';', '\t', ',', '|', None)
# Python's own also has 7_0, digits of any script, and words.
_NUMBER = re.compile(r'[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?')

_PAIR = struct.Struct('<2d')  # left and right in a message
_LINES_INSPECTED = 50  # to find the format
_LONGEST_LINE = 10_000  # the file may be gigabytes without a line
_LINES_NAMED = 5


class CsvFormat(NamedTuple):
    """How the lines of a file are read."""

    delimiter: Optional[str]
    columns: Tuple[int, ...]  # of time, left and right, from 0
    has_header: bool
    unit_ns: int  # of the time

    def numbers(self, row: str) -> Tuple[int, float, float]:
        """Return time [ns], left and right of a row.

        Raises:
            InputFault: a column is missing or no finite number, or the time cannot be a stamp.
        """
        cells = _split(row, self.delimiter)
        if len(cells) <= max(self.columns):
            raise InputFault(f'{len(cells)} columns; expected {max(self.columns) + 1} or more')
        texts = [cells[column] for column in self.columns]
        if self.delimiter != ',':
            texts = [text.replace(',', '.') for text in texts]
        for text in texts[1:]:
            if not (_is_number(text) and math.isfinite(float(text))):
                raise InputFault(f'{text!r}; expected a finite number')
        return self._time_ns(texts[0]), float(texts[1]), float(texts[2])

    def _time_ns(self, text: str) -> int:
        if _is_number(text):
            with contextlib.suppress(ArithmeticError):  # an exponent of millions
                # Exact: seconds since 1970 with nanoseconds do not fit a float.
                time_ns = Decimal(text) * self.unit_ns
                if 0 <= time_ns < LATEST_NS:
                    return int(time_ns)
        raise InputFault(f'time {text!r}; expected 0 to below 2^32 s, in the unit of --time-unit')


def find_format(lines: Sequence[str], columns: Sequence[str], time_unit: str) -> CsvFormat:
    """Find out how a file is written from its first lines.

    Args:
        lines: without empty ones.
        columns: of time, left and right as the user gives them: names, or numbers from 1.
        time_unit: one of TIME_UNITS.

    Raises:
        ConfigError: it is no table, or does not have the columns.
    """
    rows = [line for line in lines if not line.startswith(COMMENT)]
    for delimiter in _DELIMITERS:
        if 2 * sum(len(_split(row, delimiter)) >= COLUMNS for row in rows) > len(rows):
            break
    else:
        raise ConfigError(f'no table; expected {COLUMNS} or more columns, separated by , ; | tabs or spaces')
    first = _split(rows[0], delimiter)
    has_header = not any(_is_number(text.replace(',', '.')) for text in first)
    names = first if has_header else _names_in_comment(lines, delimiter, len(first))
    found = tuple(_find_column(names, len(first), column) for column in columns)
    if len(set(found)) < COLUMNS:
        raise ConfigError(f'--columns: given {" ".join(columns)}; allowed: three columns that differ')
    return CsvFormat(delimiter, found, has_header, TIME_UNITS[time_unit])


def _split(line: str, delimiter: Optional[str]) -> List[str]:
    """Split a line into cells without spaces or quotes around them."""
    return [cell.strip().strip('"\'').strip() for cell in line.strip().lstrip(COMMENT).split(delimiter)]


def _names_in_comment(lines: Sequence[str], delimiter: Optional[str], count: int) -> List[str]:
    """Return the names in the last comment above the rows, if it has one for each column."""
    comments = list(itertools.takewhile(lambda line: line.startswith(COMMENT), lines))
    names = _split(comments[-1], delimiter) if comments else []
    return names if len(names) == count else []


def _find_column(names: Sequence[str], count: int, given: str) -> int:
    numbers = [str(number) for number in range(1, count + 1)]
    for texts in (names, numbers):
        if given in texts:
            return texts.index(given)
    named = f' or a name: {", ".join(names)}' if names else '; the file has no header with names'
    raise ConfigError(f'--columns: given {given}; allowed: a number from 1 to {count}{named}')


def _is_number(text: str) -> bool:
    return _NUMBER.fullmatch(text) is not None


class CsvStream:
    """The rows of a file as messages. Bad ones are left out, and named in `fault`."""

    is_cdr = False

    def __init__(self, path: Path, columns: Sequence[str], time_unit: str) -> None:
        """Find out how the file is written.

        Args:
            path: of the file.
            columns: of time, left and right: names, or numbers from 1.
            time_unit: one of TIME_UNITS.

        Raises:
            ConfigError: it cannot be read, is no table, or does not have the columns.
        """
        self._path = path
        self.topic = path.name
        self.topics: Dict[str, str] = {self.topic: 'CSV'}
        self.fault = ''
        if path.exists() and not path.is_file():
            raise ConfigError(f'{path}: given no regular file; allowed: one, as it is read twice')
        try:
            lines = [line for _, line in itertools.islice(self._lines(), _LINES_INSPECTED)]
            self._format = find_format(lines, columns, time_unit)
        except OSError as error:
            raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
        except ConfigError as error:
            raise ConfigError(f'{path}: {error}') from None

    def messages(self, topics: Collection[str] = ()) -> Iterator[Message]:
        """Yield the rows in their order."""
        bad_lines, first_fault, newest_ns = [], '', 0  # type: List[int], str, int
        rows = ((number, line) for number, line in self._lines() if not line.startswith(COMMENT))
        for number, line in itertools.islice(rows, int(self._format.has_header), None):
            try:
                time_ns, left, right = self._format.numbers(line)
                if time_ns < newest_ns:
                    raise InputFault(f'{time_ns} ns after {newest_ns} ns; expected times that do not decrease')
            except InputFault as fault:
                bad_lines.append(number)
                first_fault = first_fault or str(fault)
            else:
                newest_ns = time_ns
                yield Message(self.topic, time_ns, _PAIR.pack(left, right))
        if bad_lines:
            listed = ', '.join([*map(str, bad_lines[:_LINES_NAMED]), *(['...'] if bad_lines[_LINES_NAMED:] else [])])
            self.fault = f'{len(bad_lines)} bad rows, in lines {listed}; the first: {first_fault}'

    def _lines(self) -> Iterator[Tuple[int, str]]:
        """Yield the lines that are not empty, each with its number; one that is too long is cut into several."""
        with open(self._path, encoding='utf-8-sig', errors='replace') as file:
            for number, line in enumerate(iter(lambda: file.readline(_LONGEST_LINE), ''), start=1):
                if line.strip():
                    yield number, line


class CsvWheels:
    """Reads the messages of a `CsvStream`."""

    are_joint_angles = False

    def __init__(
        self,
        topic: str,
        joints: Tuple[str, str],
        units: Tuple[WheelUnit, WheelUnit],
        ppr: Optional[PerWheel],
        about: str,
        notes: Sequence[str] = (),
    ) -> None:
        """Prepare to read.

        Args:
            topic: of the stream.
            joints: left, right: the names under which angles are given.
            units: of the numbers, left and right.
            ppr: of counts.
            about: what the numbers are, for the reader.
            notes: what the angles cannot show.
        """
        self.topics: Tuple[str, ...] = (topic,)
        self.joints, self.ppr = joints, ppr
        self.text = f'rows ({about})'
        self._notes, self._units = notes, units
        self._numbers = WheelNumbers(), WheelNumbers()

    def add(self, message: Message) -> None:
        """Add a row."""
        for numbers, value in zip(self._numbers, _PAIR.unpack(message.raw)):
            numbers.add(message.time_ns, message.time_ns, value)

    def drives(self) -> List[TimedDrive]:
        """Return the one drive of the table."""
        left, right = (wheel_angles(numbers.series(), unit) for numbers, unit in zip(self._numbers, self._units))
        return paired_drives(left, right)[0]

    def notes(self) -> Iterator[str]:
        """List what the angles cannot show; bad rows are the stream's."""
        return iter(self._notes)
