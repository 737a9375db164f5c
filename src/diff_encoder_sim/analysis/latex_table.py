"""Tables as LaTeX, to read."""

from __future__ import annotations

from typing import List, Sequence

from diff_encoder_sim.analysis.table import Entry, Number, Table, abreast, equal_neighbours, is_number_column, rounded

_LATEX_ESCAPES = str.maketrans(
    {
        '\\': r'\textbackslash{}',
        '~': r'\textasciitilde{}',
        '^': r'\textasciicircum{}',
        **{char: f'\\{char}' for char in '&%$#_{}'},
    }
)


def latex_text(table: Table) -> str:
    r"""Format a table as LaTeX, for \input in a document that uses booktabs."""
    lines = [
        r'% \usepackage{booktabs}',
        r'\begin{table}',
        r'\centering\scriptsize',
        r'\setlength{\tabcolsep}{3pt}',
        rf'\caption{{{_latex(table.title)}}}',
        rf'\label{{tab:{table.name}}}',
    ]
    for columns in abreast(table.columns):
        lines += _latex_tabular(table, columns)
    lines += [rf'\par\raggedright {_latex(note)}' for note in table.notes]
    return '\n'.join([*lines, r'\end{table}', ''])


def _latex_tabular(table: Table, columns: Sequence[int]) -> List[str]:
    alignment = ''.join('r' if is_number_column(table, index) else 'l' for index in columns)
    heads = ' & '.join(_latex(table.columns[index].head) for index in columns)
    lines = [
        rf'\begin{{tabular}}{{{alignment}}}',
        r'\toprule',
        *_latex_groups(table, columns),
        rf'{heads} \\',
        r'\midrule',
    ]
    for number, row in enumerate(table.rows):
        if number and row[0] != table.rows[number - 1][0]:
            lines.append(r'\midrule')
        lines.append(' & '.join(_latex_entry(row[index]) for index in columns) + r' \\')
    return [*lines, r'\bottomrule', r'\end{tabular}', r'\par\medskip']


def _latex_groups(table: Table, columns: Sequence[int]) -> List[str]:
    """Return the line of group headings and the rules below them; nothing without groups."""
    cells, rules = [], []
    for group, first, last in equal_neighbours([table.columns[index].group for index in columns]):
        if group:
            cells.append(rf'\multicolumn{{{last - first + 1}}}{{c}}{{{_latex(group)}}}')
            rules.append(rf'\cmidrule(lr){{{first}-{last}}}')
        else:
            cells += [''] * (last - first + 1)
    return [' & '.join(cells) + r' \\', ' '.join(rules)] if rules else []


def _latex_entry(entry: Entry) -> str:
    text = rounded(entry, '--')
    is_known = isinstance(entry, Number) and entry.value is not None
    return text.replace('-', '$-$') if is_known else _latex(text)


def _latex(text: str) -> str:
    return text.translate(_LATEX_ESCAPES)
