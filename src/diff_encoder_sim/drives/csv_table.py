"""Tables in text files: their format, their rows as messages, and the wheels in them."""

from __future__ import annotations

import itertools
import math
import re
import struct
from decimal import Decimal
from pathlib import Path
from typing import Collection, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import LATEST_NS
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import NUMBER_SIZE
from diff_encoder_sim.drives.number_units import TIME_UNITS
from diff_encoder_sim.drives.wheel_source import WheelNumbers, WheelSource

COMMENT = '#'
COLUMNS = 3  # at least: time, and two numbers of the wheels or of a reference

# The first that gives enough columns; None stands for any spaces. A comma may also be a decimal sign.
_DELIMITERS: Tuple[Optional[str], ...] = (';', '\t', ',', '|', None)
# Python's own also has 7_0, digits of any script, words, and exponents of millions.
_NUMBER = re.compile(r'[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?')

_LINES_INSPECTED = 50  # to find the format
_LONGEST_LINE = 10_000  # the file may be gigabytes without a line
_LINES_NAMED = 5


class CsvFormat(NamedTuple):
    """Format of the lines of a file."""

    delimiter: Optional[str]
    columns: Tuple[int, ...]  # of the time and the other numbers, from 0
    has_header: bool
    unit_ns: int  # of the time

    def numbers(self, row: str) -> Tuple[int, List[float]]:
        """Return the time [ns] and the other numbers of a row; InputFault if one is missing or invalid."""
        cells = _split(row, self.delimiter)
        if len(cells) <= max(self.columns):
            raise InputFault(f'{len(cells)} columns; expected {max(self.columns) + 1} or more')
        texts = [cells[column] for column in self.columns]
        if self.delimiter != ',':
            texts = [text.replace(',', '.') for text in texts]
        for text in texts:
            if not (_NUMBER.fullmatch(text) and math.isfinite(float(text))):
                raise InputFault(f'{text!r}; expected a finite number')
        time_ns = Decimal(texts[0]) * self.unit_ns  # exact: seconds since 1970 with nanoseconds do not fit a float
        if not 0 <= time_ns < LATEST_NS:
            raise InputFault(f'time {texts[0]!r}; expected 0 to below 2^32 s, in the unit of --time-unit')
        return int(time_ns), [float(text) for text in texts[1:]]


def find_format(lines: Sequence[str], columns: Sequence[str], time_unit: str, option: str = '--columns') -> CsvFormat:
    """Detect the format of a file from its first lines, without empty ones; ConfigError if it is no such table.

    `columns` are those of the time and the other numbers as the user gives them in `option`: names, or numbers from 1.
    """
    rows = [line for line in lines if not line.startswith(COMMENT)]
    for delimiter in _DELIMITERS:
        if 2 * sum(len(_split(row, delimiter)) >= COLUMNS for row in rows) > len(rows):
            break
    else:
        raise ConfigError(f'no table; expected {COLUMNS} or more columns, separated by , ; | tabs or spaces')
    names = _split(rows[0], delimiter)
    numbers = [str(number) for number in range(1, len(names) + 1)]
    has_header = not any(_NUMBER.fullmatch(text.replace(',', '.')) for text in names)
    if not has_header:  # the names may be in the last comment above the rows
        comments = list(itertools.takewhile(lambda line: line.startswith(COMMENT), lines))
        names = _split(comments[-1], delimiter) if comments else []
        names = names if len(names) == len(numbers) else []
    found = []
    for column in columns:
        if column not in (*names, *numbers):
            named = f' or a name: {", ".join(names)}' if names else '; the file has no header with names'
            raise ConfigError(f'{option}: given {column}; allowed: a number from 1 to {len(numbers)}{named}')
        found.append((names if column in names else numbers).index(column))
    if len(set(found)) < len(found):
        raise ConfigError(f'{option}: given {" ".join(columns)}; allowed: columns that differ')
    return CsvFormat(delimiter, tuple(found), has_header, TIME_UNITS[time_unit])


def _split(line: str, delimiter: Optional[str]) -> List[str]:
    """Split a line into cells without spaces or quotes around them."""
    return [cell.strip().strip('"\'').strip() for cell in line.strip().lstrip(COMMENT).split(delimiter)]


class CsvStream(DriveStream):
    """The rows of a file as messages. Invalid ones are left out, and listed in `fault`."""

    def __init__(
        self, path: Path, columns: Sequence[str], time_unit: str, option: str = '--columns', is_ordered: bool = True
    ) -> None:
        """Detect the format as `find_format` does; rows with an earlier time are invalid if the table `is_ordered`."""
        super().__init__(path)
        self.topic, self._is_ordered = path.name, is_ordered
        self.topics[self.topic] = 'CSV'
        if path.exists() and not path.is_file():
            raise ConfigError(f'{path}: given no regular file; allowed: one, as it is read twice')
        try:
            lines = [line for _, line in itertools.islice(self._lines(), _LINES_INSPECTED)]
            self._format = find_format(lines, columns, time_unit, option)
        except OSError as error:
            raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
        except ConfigError as error:
            raise ConfigError(f'{path}: {error}') from None

    def _messages(self, topics: Collection[str]) -> Iterator[Message]:
        bad_lines, first_fault, newest_ns = [], '', 0  # type: List[int], str, int
        rows = ((number, line) for number, line in self._lines() if not line.startswith(COMMENT))
        for number, line in itertools.islice(rows, int(self._format.has_header), None):
            try:
                time_ns, values = self._format.numbers(line)
                if self._is_ordered and time_ns < newest_ns:
                    raise InputFault(f'{time_ns} ns after {newest_ns} ns; expected times that do not decrease')
            except InputFault as fault:
                bad_lines.append(number)
                first_fault = first_fault or str(fault)
            else:
                newest_ns = time_ns
                yield Message(self.topic, time_ns, struct.pack(f'<{len(values)}d', *values))
        if bad_lines:
            listed = ', '.join([*map(str, bad_lines[:_LINES_NAMED]), *(['...'] if bad_lines[_LINES_NAMED:] else [])])
            self.fault = f'{len(bad_lines)} bad rows, in lines {listed}; the first: {first_fault}'

    def _lines(self) -> Iterator[Tuple[int, str]]:
        """Yield the lines that are not empty, each with its number; one that is too long is cut into several."""
        with open(self.path, encoding='utf-8-sig', errors='replace') as file:
            for number, line in enumerate(iter(lambda: file.readline(_LONGEST_LINE), ''), start=1):
                if line.strip():
                    yield number, line


def row_numbers(message: Message) -> Tuple[float, ...]:
    """Return the numbers of a row after its time."""
    return struct.unpack(f'<{len(message.raw) // NUMBER_SIZE}d', message.raw)


class CsvWheels(WheelSource):
    """Reads the messages of a `CsvStream`."""

    def __init__(self, topic: str, joints: Tuple[str, str], numbers: WheelNumbers) -> None:
        super().__init__([topic], joints, f'rows ({numbers.text})', numbers)

    def add(self, message: Message) -> None:
        """Add a row."""
        for side, value in enumerate(row_numbers(message)):
            self._append(side, message.time_ns, message.time_ns, value)
