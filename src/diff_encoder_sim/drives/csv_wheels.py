"""A drive in a CSV file: how it is written, its rows as a stream of messages, and the wheel angles in them."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import struct
from decimal import Decimal
from pathlib import Path
from typing import Collection, Dict, Iterator, List, NamedTuple, Optional, Sequence, TextIO, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import LATEST_NS
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.number_units import TIME_UNITS
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.wheel_units import WheelAngle, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel

COMMENT = '#'
# Time, left, right.
COLUMNS = 3

# The first that gives enough columns; None stands for any spaces. A comma may also be a decimal sign.
_DELIMITERS: Tuple[Optional[str], ...] = (';', '\t', ',', '|', None)


# Python's own also has 7_0, digits of any script, and words.
_NUMBER = re.compile(r'[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?')


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
        cells = split(row, self.delimiter)
        if len(cells) <= max(self.columns):
            raise InputFault(f'{len(cells)} columns; expected {max(self.columns) + 1} or more')
        texts = [cells[column] for column in self.columns]
        if self.delimiter != ',':
            texts = [text.replace(',', '.') for text in texts]
        left, right = (_finite(text) for text in texts[1:])
        return self._time_ns(texts[0]), left, right

    def _time_ns(self, text: str) -> int:
        if _is_number(text):
            with contextlib.suppress(ArithmeticError):  # an exponent of millions
                # Exact: seconds since 1970 with nanoseconds do not fit a float.
                time_ns = Decimal(text) * self.unit_ns
                if 0 <= time_ns < LATEST_NS:
                    return int(time_ns)
        raise InputFault(f'time {text!r}; expected 0 to below 2^32 s, in the unit of --time-unit')


def _finite(text: str) -> float:
    number = float(text) if _is_number(text) else math.nan
    if not math.isfinite(number):
        raise InputFault(f'{text!r}; expected a finite number')
    return number


def split(line: str, delimiter: Optional[str]) -> List[str]:
    """Split a line into cells without spaces or quotes around them."""
    return [cell.strip().strip('"\'').strip() for cell in line.strip().lstrip(COMMENT).split(delimiter)]


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
    delimiter = _find_delimiter(rows)
    first = split(rows[0], delimiter)
    has_header = not any(_is_number(text.replace(',', '.')) for text in first)
    names = first if has_header else _names_in_comment(lines, delimiter, len(first))
    found = tuple(_find_column(names, len(first), column) for column in columns)
    if len(set(found)) < COLUMNS:
        raise ConfigError(f'--columns: given {" ".join(columns)}; allowed: three columns that differ')
    return CsvFormat(delimiter, found, has_header, TIME_UNITS[time_unit])


def _find_delimiter(rows: Sequence[str]) -> Optional[str]:
    """Return the first delimiter by which most of the rows have enough columns; None for spaces."""
    for delimiter in _DELIMITERS:
        if 2 * sum(len(split(row, delimiter)) >= COLUMNS for row in rows) > len(rows):
            return delimiter
    raise ConfigError(f'no table; expected {COLUMNS} or more columns, separated by , ; | tabs or spaces')


def _names_in_comment(lines: Sequence[str], delimiter: Optional[str], count: int) -> List[str]:
    """Return the names in the last comment above the rows, where it has one for each column."""
    comments = list(itertools.takewhile(lambda line: line.startswith(COMMENT), lines))
    names = split(comments[-1], delimiter) if comments else []
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


# Left and right in a message.
PAIR = struct.Struct('<2d')

# By so many lines the format is found.
_LINES_LOOKED_AT = 50
# No more is read at once: the file may be gigabytes of no text.
_LONGEST_LINE = 10_000
_LINES_NAMED = 5


class CsvStream:
    """The rows of a file, read as they are asked for. Bad ones are left out, and named in `fault`."""

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
            lines = [line for _, line in itertools.islice(self._lines(), _LINES_LOOKED_AT)]
            self._format = find_format(lines, columns, time_unit)
        except OSError as error:
            raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
        except ConfigError as error:
            raise ConfigError(f'{path}: {error}') from None

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the rows in their order."""
        faults, newest_ns = _BadRows(), 0
        rows = ((number, line) for number, line in self._lines() if not line.startswith(COMMENT))
        for number, line in itertools.islice(rows, int(self._format.has_header), None):
            try:
                time_ns, left, right = self._format.numbers(line)
                if time_ns < newest_ns:
                    raise InputFault(f'{time_ns} ns after {newest_ns} ns; expected times that do not decrease')
            except InputFault as fault:
                faults.add(number, fault)
                self.fault = faults.text()
            else:
                newest_ns = time_ns
                yield Message(self.topic, time_ns, PAIR.pack(left, right))

    def _lines(self) -> Iterator[Tuple[int, str]]:
        """Yield the lines that are not empty, each with its number."""
        with open(self._path, encoding='utf-8-sig', errors='replace') as file:
            for number, line in enumerate(_bounded_lines(file), start=1):
                if line.strip():
                    yield number, line


class _BadRows:
    def __init__(self) -> None:
        self._count, self._lines, self._why = 0, '', ''

    def add(self, line: int, fault: InputFault) -> None:
        self._count += 1
        self._why = self._why or str(fault)
        if self._count <= _LINES_NAMED:
            self._lines += f', {line}' if self._lines else str(line)

    def text(self) -> str:
        more = ', ...' if self._count > _LINES_NAMED else ''
        return f'{self._count} bad rows, in lines {self._lines}{more}; the first: {self._why}'


def _bounded_lines(file: TextIO) -> Iterator[str]:
    """Yield lines; one that is too long to be a row is cut into several."""
    return iter(lambda: file.readline(_LONGEST_LINE), '')


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
        self._notes = notes
        self._wheels = (WheelAngle(units[0]), WheelAngle(units[1]))

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return both wheels."""
        values = zip(self._wheels, PAIR.unpack(message.raw))
        angles_rad = [wheel.angle_rad(message.time_ns, value) for wheel, value in values]
        return (JointValues(message.time_ns, self.joints, angles_rad),)

    def notes(self) -> Iterator[str]:
        """List what the angles cannot show; bad rows are the stream's."""
        return iter(self._notes)
