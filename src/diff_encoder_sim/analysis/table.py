"""Tables as data, and as files: CSV to compute with, Markdown and LaTeX to read, and the blocks of a page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from tabulate import tabulate

from diff_encoder_sim.base.deferred import deferred

pandas = deferred('pandas')

# So many groups of columns fit the width of a page; others follow below, with the key columns again.
GROUPS_ABREAST = 4

# The paper's tables, ours and both beside each other, are also written as Markdown and LaTeX.
OF_PAPER = re.compile(r'(paper_)?table[3-6]')


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


def csv_text(table: Table) -> str:
    """Format a table as CSV: all digits, empty if there is no number, without title and notes."""
    names = [column.name for column in table.columns]
    exact = pandas.DataFrame([[_exact(entry) for entry in row] for row in table.rows], columns=names, dtype=object)
    return str(exact.to_csv(index=False, lineterminator='\n'))


def _exact(entry: Entry) -> Union[str, float, None]:
    if not isinstance(entry, Number):
        return entry.name if isinstance(entry, Label) else entry
    if entry.value is None:
        return None
    return float(entry.value) if entry.decimals else int(entry.value)


def markdown_text(table: Table) -> str:
    """Format a table as Markdown, as GitHub shows it."""

    def escaped(text: str) -> str:
        return re.sub(r'([\\|_*<])', r'\\\1', text)

    parts = [f'**{escaped(table.title)}**']
    for columns in abreast(table.columns):
        heads = [escaped(f'{table.columns[index].group} {table.columns[index].head}'.strip()) for index in columns]
        rows = [[escaped(rounded(row[index], '–')) for index in columns] for row in table.rows]
        sides = ['right' if is_number_column(table, index) else 'left' for index in columns]
        parts.append(tabulate(rows, heads, tablefmt='pipe', colalign=sides if rows else None, disable_numparse=True))
    parts.append('\n'.join(f'- {escaped(note)}' for note in table.notes))
    return '\n\n'.join(part for part in parts if part) + '\n'


def latex_text(table: Table) -> str:
    r"""Format a table as LaTeX, for \input in a document that uses booktabs."""
    parts = [r'\begin{table}', r'\centering\scriptsize', r'\setlength{\tabcolsep}{3pt}']
    parts += [rf'\caption{{{_latex(table.title)}}}', rf'\label{{tab:{table.name}}}']
    for columns in abreast(table.columns):
        heads: Any = [table.columns[index].head for index in columns]
        groups = [table.columns[index].group for index in columns]
        if any(groups):
            heads = pandas.MultiIndex.from_arrays([groups, heads])
        texts = [[rounded(row[index], '–') for index in columns] for row in table.rows]
        sides = ''.join('r' if is_number_column(table, index) else 'l' for index in columns)
        block = pandas.DataFrame(texts, columns=heads).to_latex(
            index=False, escape=True, column_format=sides, multicolumn_format='c'
        )
        parts += [re.sub(r'(^|& )-(?=[\di])', r'\1$-$', block, flags=re.MULTILINE).rstrip(), r'\par\medskip']
    parts += [rf'\par\raggedright {_latex(note)}' for note in table.notes]
    return '\n'.join([r'% \usepackage{booktabs}', *parts, r'\end{table}', ''])


def _latex(text: str) -> str:
    special = {'\\': r'\textbackslash{}', '~': r'\textasciitilde{}', '^': r'\textasciicircum{}'}
    escapes = {**special, **{char: f'\\{char}' for char in '&%$#_{}'}}
    return ''.join(escapes.get(char, char) for char in text)


def write_tables(tables: Sequence[Table], folder: Path) -> None:
    """Write each table as CSV, the paper's also as Markdown and LaTeX, into `folder`, which is created.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for table in tables:
        texts = {'csv': csv_text(table)}
        if OF_PAPER.fullmatch(table.name):
            texts.update(md=markdown_text(table), tex=latex_text(table))
        for suffix, text in texts.items():
            # Bytes: the same line ends on every system.
            (folder / f'{table.name}.{suffix}').write_bytes(text.encode('utf-8'))


class Group(NamedTuple):
    """A heading over neighbouring columns; the text is empty over the key columns."""

    text: str
    span: int


class Head(NamedTuple):
    """The heading of a column."""

    text: str
    is_number: bool  # aligned to the right


class Row(NamedTuple):
    """The texts of a row."""

    entries: List[str]
    is_first: bool  # its first entry differs from that of the row above


class Block(NamedTuple):
    """Columns beside each other."""

    groups: List[Group]  # none where the table has none
    heads: List[Head]
    keys: int  # number of key columns
    rows: List[Row]


class HtmlTable(NamedTuple):
    """A table for the template."""

    title: str
    blocks: List[Block]
    notes: List[str]


def html_table(table: Table) -> HtmlTable:
    """Convert a table; numbers are rounded, missing ones a dash."""
    return HtmlTable(table.title, [_block(table, columns) for columns in abreast(table.columns)], table.notes)


def _block(table: Table, indices: List[int]) -> Block:
    columns = [table.columns[index] for index in indices]
    runs = equal_neighbours([column.group for column in columns])
    has_groups = any(text for text, _, _ in runs)
    groups = [Group(text, last - first + 1) for text, first, last in runs] if has_groups else []
    heads = [
        Head(column.head, bool(column.group) or is_number_column(table, index))
        for column, index in zip(columns, indices)
    ]
    keys = sum(not column.group for column in columns) if has_groups else 1
    return Block(groups, heads, keys, _rows(table, indices))


def _rows(table: Table, indices: List[int]) -> List[Row]:
    rows = []
    for number, row in enumerate(table.rows):
        is_first = number > 0 and row[0] != table.rows[number - 1][0]
        rows.append(Row([rounded(row[index], '–') for index in indices], is_first))
    return rows
