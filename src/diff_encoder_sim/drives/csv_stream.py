"""A drive in a CSV file, as a stream of messages that have the time, and the numbers of both wheels."""

from __future__ import annotations

import itertools
import struct
from pathlib import Path
from typing import Collection, Dict, Iterator, Sequence, TextIO, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.csv_format import COMMENT, find_format

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
