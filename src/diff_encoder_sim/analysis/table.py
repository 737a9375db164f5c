"""Tables as data, and how their columns are laid out on a page."""

from __future__ import annotations

from typing import Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

# So many groups of columns fit the width of a page; others follow below, with the key columns again.
GROUPS_ABREAST = 4


class Number(NamedTuple):
    """A number, and how many decimals tables show; CSV has all."""

    value: Optional[float]  # None where there is no such number
    decimals: int


class Label(NamedTuple):
    """A text as CSV has it, and as tables show it."""

    name: str
    head: str


Entry = Union[str, Label, Number]


class Column(NamedTuple):
    """A column; those without a group come first and are the keys of the rows."""

    name: str  # in CSV, with the unit
    head: str  # as tables show it, with the unit
    group: str = ''  # a heading over neighbouring columns


class Table(NamedTuple):
    """A table, independent of the format it is written in."""

    name: str  # of its files, without suffix
    title: str
    columns: List[Column]
    rows: List[List[Entry]]  # an entry for each column
    notes: List[str]  # below it, a sentence or two each


def abreast(columns: Sequence[Column]) -> Iterator[List[int]]:
    """Yield the indices of the columns of each block that fits the page's width, the key columns in each."""
    keys = [index for index, column in enumerate(columns) if not column.group]
    groups = list(dict.fromkeys(column.group for column in columns if column.group))
    for first in range(0, max(len(groups), 1), GROUPS_ABREAST):
        shown = groups[first : first + GROUPS_ABREAST]
        yield keys + [index for index, column in enumerate(columns) if column.group in shown]


def is_number_column(table: Table, index: int) -> bool:
    """Return whether a column is aligned to the right."""
    return bool(table.rows) and all(isinstance(row[index], Number) for row in table.rows)


def rounded(entry: Entry, absent: str) -> str:
    """Format an entry as tables show it; `absent` replaces a missing number."""
    if not isinstance(entry, Number):
        return entry.head if isinstance(entry, Label) else entry
    if entry.value is None:
        return absent
    # Adding zero removes the sign of what is rounded to zero.
    return f'{round(entry.value, entry.decimals) + 0.0:.{entry.decimals}f}'


def equal_neighbours(texts: Sequence[str]) -> List[Tuple[str, int, int]]:
    """Return the runs of equal neighbours: text, first and last position, from 1."""
    runs: List[Tuple[str, int, int]] = []
    for position, text in enumerate(texts, start=1):
        if runs and runs[-1][0] == text:
            runs[-1] = (text, runs[-1][1], position)
        else:
            runs.append((text, position, position))
    return runs
