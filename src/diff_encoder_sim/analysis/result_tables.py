"""Result tables: a DataFrame with all digits for CSV, and the formatting of its columns for pages."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Tuple, Union

from tabulate import tabulate

from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES
from diff_encoder_sim.base.deferred import pandas as pd

# Column groups per page width; further groups follow in another block with the key columns repeated.
GROUPS_ABREAST = 4

# Tables of the paper, which are also written as Markdown and LaTeX.
OF_PAPER = re.compile(r'(paper_)?table[3-6]')

NOTHING = '–'

# Labels on pages for values in CSV files.
LABELS = {
    **POSES,
    **{quantity.name: quantity.head for quantity in QUANTITIES},
    'std': 'std. dev.',
    'pct_within': '% within',
    'position_mm': 'position [mm]',
    'heading_deg': 'heading [deg]',
}


HEADS = {'ppr': 'PPR', 'quantity': 'error'}  # default headings of columns


class ResultTable(NamedTuple):
    """Table and its formatting."""

    name: str  # file name without suffix
    title: str
    exact: pd.DataFrame  # content of the CSV file; column names contain units
    # Group (a heading over neighbouring columns) and heading with unit, by column. Columns without a group come first
    # and are the keys of the rows; by default a column has its name (or that in `HEADS`) as heading and no group.
    heads: Mapping[str, Tuple[str, str]] = {}
    decimals: Mapping[str, Union[int, Sequence[int]]] = {}  # per numeric column, or per entry of a column
    notes: Sequence[str] = ()  # one or two sentences each, shown below the table

    def shown(self) -> pd.DataFrame:
        """Return the table as strings: rounded numbers, `NOTHING` for missing ones."""
        texts = {}
        for name, values in self.exact.items():
            decimals = self.decimals.get(name)
            each = itertools.repeat(decimals) if isinstance(decimals, int) else decimals
            pairs = zip(values, each) if each is not None else ()
            texts[name] = [_rounded(*pair) for pair in pairs] or [LABELS.get(text, text) for text in values]
        return pd.DataFrame(texts, columns=self.exact.columns, dtype=object)

    def head(self, name: str) -> Tuple[str, str]:
        """Return the group and the heading of a column."""
        return self.heads.get(name, ('', HEADS.get(name, name)))

    def abreast(self) -> Iterator[List[str]]:
        """Yield the columns of each block that fits the page width, including the key columns."""
        groups = list(dict.fromkeys(group for group, _ in map(self.head, self.exact.columns) if group))
        for first in range(0, max(len(groups), 1), GROUPS_ABREAST):
            shown = ['', *groups[first : first + GROUPS_ABREAST]]
            yield [name for name in self.exact.columns if self.head(name)[0] in shown]


def _rounded(value: Any, decimals: int) -> str:
    # Adding zero removes the sign of a rounded zero.
    return NOTHING if pd.isna(value) else f'{round(float(value), decimals) + 0.0:.{decimals}f}'


def write_tables(tables: Sequence[ResultTable], folder: Path) -> None:
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
            # Bytes keep line endings equal on every system.
            (folder / f'{table.name}.{suffix}').write_bytes(text.encode('utf-8'))


def csv_text(table: ResultTable) -> str:
    """Format a table as CSV with all digits; missing numbers are empty."""
    return str(table.exact.astype(object).to_csv(index=False, lineterminator='\n'))


def markdown_text(table: ResultTable) -> str:
    """Format a table as GitHub Markdown."""

    def escaped(text: str) -> str:
        return re.sub(r'([\\|_*<])', r'\\\1', text)

    shown, parts = table.shown(), [f'**{escaped(table.title)}**']
    for names in table.abreast():
        heads = [escaped(' '.join(table.head(name)).strip()) for name in names]
        rows = [list(map(escaped, row)) for row in shown[names].itertuples(index=False)]
        sides = ['right' if name in table.decimals else 'left' for name in names]
        parts.append(tabulate(rows, heads, tablefmt='pipe', colalign=sides if rows else None, disable_numparse=True))
    parts.append('\n'.join(f'- {escaped(note)}' for note in table.notes))
    return '\n\n'.join(part for part in parts if part) + '\n'


def latex_text(table: ResultTable) -> str:
    r"""Format a table as LaTeX, for \input in a document that uses booktabs."""
    parts = [r'% \usepackage{booktabs}', r'\begin{table}', r'\centering\scriptsize', r'\setlength{\tabcolsep}{3pt}']
    parts += [rf'\caption{{{_latex(table.title)}}}', rf'\label{{tab:{table.name}}}']
    for names in table.abreast():
        heads = [table.head(name) for name in names]
        has_groups = any(group for group, _ in heads)
        columns = pd.MultiIndex.from_tuples(heads) if has_groups else [head for _, head in heads]
        sides = ''.join('r' if name in table.decimals else 'l' for name in names)
        block = table.shown()[names].set_axis(columns, axis=1)
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
    for names in table.abreast():
        groups = [(group, len(list(same))) for group, same in itertools.groupby(table.head(name)[0] for name in names)]
        rows = shown[names].values.tolist()
        blocks.append(
            {
                'groups': groups if any(group for group, _ in groups) else [],
                'heads': [(table.head(name)[1], bool(table.head(name)[0]) or name in table.decimals) for name in names],
                'keys': groups[0][1] if len(groups) > 1 else 1,
                # Flag: the first entry differs from that of the row above.
                'rows': [(row, place > 0 and row[0] != rows[place - 1][0]) for place, row in enumerate(rows)],
            }
        )
    return blocks
