"""How a CSV file is written: its delimiter, its columns, and the numbers in them."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
from decimal import Decimal
from typing import List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import LATEST_NS

COMMENT = '#'
TIME_UNITS = {'s': 10**9, 'ms': 10**6, 'us': 10**3, 'ns': 1}  # in nanoseconds
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
