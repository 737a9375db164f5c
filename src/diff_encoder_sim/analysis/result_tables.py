"""Tables for pages and files.

Result tables are a DataFrame with all digits for CSV, and the formatting of its columns; text tables are strings for
the terminal and for pages.
"""

from __future__ import annotations

import functools
import itertools
import re
import textwrap
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Union

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES
from diff_encoder_sim.base.deferred import pandas as pd

GROUPS_ABREAST = 4  # column groups per page width; the others follow in another block with the key columns
OF_PAPER = re.compile(r'(paper_)?table[3-6]')  # also written as Markdown and LaTeX
NOTE_COLUMNS = 100  # of notes in the terminal
NOTHING = '–'
LABELS = {  # on pages for values in CSV files
    **POSES,
    **{quantity.name: f'{quantity.axis} [{quantity.unit}]' for quantity in QUANTITIES},
    'std': 'std. dev.',
    'pct_within': '% within',
    'position_mm': 'position [mm]',
    'heading_deg': 'heading [deg]',
}
HEADS = {'ppr': 'counts', 'quantity': 'error'}  # default headings of columns
Decimals = Union[int, Sequence[int], None]  # of the numbers of a column, or of each entry; None for texts


class Column(NamedTuple):
    """Heading and format of a column."""

    head: str  # with unit
    group: str = ''  # heading over neighbouring columns; columns without one come first and are the keys of the rows
    decimals: Decimals = None


class ResultTable(NamedTuple):
    """Table and its formatting."""

    name: str  # file name without suffix
    title: str
    exact: pd.DataFrame  # content of the CSV file; column names contain units
    columns: Mapping[str, Column] = {}  # by name; others are texts with their name (or that in `HEADS`) as heading
    notes: Sequence[str] = ()  # one or two sentences each, shown below the table

    def column(self, name: str) -> Column:
        """Return the formatting of a column."""
        return self.columns.get(name, Column(HEADS.get(name, name)))

    def shown(self) -> pd.DataFrame:
        """Return the table as strings: rounded numbers, `NOTHING` for missing ones."""
        texts = {}
        for name, values in self.exact.items():
            decimals = self.column(name).decimals
            if decimals is None:
                texts[name] = [LABELS.get(text, text) for text in values]
            else:  # adding zero removes the sign of a rounded zero
                pairs = zip(values, np.broadcast_to(decimals, len(values)).tolist())
                texts[name] = [NOTHING if pd.isna(one) else f'{round(float(one), n) + 0.0:.{n}f}' for one, n in pairs]
        return pd.DataFrame(texts, columns=self.exact.columns, dtype=object)

    def abreast(self) -> Iterator[Dict[str, Column]]:
        """Yield the columns of each block that fits the page width, including the key columns."""
        columns = {name: self.column(name) for name in self.exact.columns}
        groups = list(dict.fromkeys(column.group for column in columns.values() if column.group))
        for first in range(0, max(len(groups), 1), GROUPS_ABREAST):
            shown = ['', *groups[first : first + GROUPS_ABREAST]]
            yield {name: column for name, column in columns.items() if column.group in shown}


def write_tables(tables: Sequence[ResultTable], folder: Path) -> None:
    """Write each table as CSV, the paper's also as Markdown and LaTeX, and create `folder`; OSError if one fails."""
    folder.mkdir(parents=True, exist_ok=True)
    for table in tables:
        texts = {'csv': csv_text(table)}
        if OF_PAPER.fullmatch(table.name):
            texts.update(md=markdown_text(table), tex=latex_text(table))
        for suffix, text in texts.items():
            (folder / f'{table.name}.{suffix}').write_bytes(text.encode('utf-8'))  # with the same line endings anywhere


def csv_text(table: ResultTable) -> str:
    """Format a table as CSV with all digits; missing numbers are empty."""
    return str(table.exact.astype(object).to_csv(index=False, lineterminator='\n'))


def markdown_text(table: ResultTable) -> str:
    """Format a table as GitHub Markdown."""
    escaped = functools.partial(re.sub, r'([\\|_*<])', r'\\\1')
    shown, parts = table.shown(), [f'**{escaped(table.title)}**']
    for columns in table.abreast():
        heads = [escaped(f'{column.group} {column.head}'.strip()) for column in columns.values()]
        rows = [list(map(escaped, row)) for row in shown[list(columns)].itertuples(index=False)]
        sides = ['left' if column.decimals is None else 'right' for column in columns.values()]
        parts.append(tabulate(rows, heads, tablefmt='pipe', colalign=sides if rows else None, disable_numparse=True))
    return '\n\n'.join([*parts, *filter(None, ['\n'.join(f'- {escaped(note)}' for note in table.notes)])]) + '\n'


def latex_text(table: ResultTable) -> str:
    r"""Format a table as LaTeX, for \input in a document that uses booktabs."""
    parts = [r'% \usepackage{booktabs}', r'\begin{table}', r'\centering\scriptsize', r'\setlength{\tabcolsep}{3pt}']
    parts += [rf'\caption{{{_latex(table.title)}}}', rf'\label{{tab:{table.name}}}']
    for columns in table.abreast():
        heads = [column[:2][::-1] for column in columns.values()]
        names = pd.MultiIndex.from_tuples(heads) if any(group for group, _ in heads) else [head for _, head in heads]
        sides = ''.join('l' if column.decimals is None else 'r' for column in columns.values())
        block = table.shown()[list(columns)].set_axis(names, axis=1)
        text = block.to_latex(index=False, escape=True, column_format=sides, multicolumn_format='c')
        parts += [re.sub(r'(^|& )-(?=[\di])', r'\1$-$', text, flags=re.MULTILINE).rstrip(), r'\par\medskip']
    parts += [rf'\par\raggedright {_latex(note)}' for note in table.notes]
    return '\n'.join([*parts, r'\end{table}', ''])


def _latex(text: str) -> str:
    special = {'\\': r'\textbackslash{}', '~': r'\textasciitilde{}', '^': r'\textasciicircum{}'}
    escapes = {**special, **{char: f'\\{char}' for char in '&%$#_{}'}}
    return ''.join(escapes.get(char, char) for char in text)


def html_table(table: ResultTable) -> List[Dict[str, Any]]:
    """Return blocks of columns that fit the page width, for the macros of tables.html."""
    blocks, shown = [], table.shown()
    for columns in table.abreast():
        groups = [(group, len(list(same))) for group, same in itertools.groupby(one.group for one in columns.values())]
        heads = [(one.head, bool(one.group) or one.decimals is not None) for one in columns.values()]
        rows, keys = shown[list(columns)].values.tolist(), groups[0][1] if len(groups) > 1 else 1
        groups = groups if any(group for group, _ in groups) else []
        blocks.append({'groups': groups, 'heads': heads, 'keys': keys, 'rows': rows})
    return blocks


class TextTable(NamedTuple):
    """Table of strings."""

    title: str
    heads: List[str]
    rows: List[List[str]]
    note: str = ''
    texts: int = 2  # columns on the left that are aligned left

    def text(self) -> str:
        """Return the table for the terminal."""
        aligned = [*['left'] * self.texts, *['right'] * (len(self.heads) - self.texts)]
        text = tabulate(self.rows, self.heads, disable_numparse=True, colalign=aligned)
        return '\n'.join([self.title, text, *(textwrap.fill(line, NOTE_COLUMNS) for line in self.note.splitlines())])

    @property
    def block(self) -> Dict[str, Any]:
        """Return the table for the macros of tables.html."""
        heads = [(head, place >= self.texts) for place, head in enumerate(self.heads)]
        return {'groups': [], 'heads': heads, 'keys': 0, 'rows': self.rows}
