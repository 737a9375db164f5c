"""Writes tables: CSV to compute with, Markdown and LaTeX to read."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Callable, Dict, Iterable, Sequence

from diff_encoder_sim.analysis.latex_table import latex_text
from diff_encoder_sim.analysis.table import Entry, Label, Number, Table, abreast, is_number_column, rounded
from diff_encoder_sim.base.text_values import text_cell


def csv_text(table: Table) -> str:
    """Format a table as CSV: all digits, empty where there is no number, without title and notes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow([text_cell(column.name) for column in table.columns])
    writer.writerows([_exact(entry) for entry in row] for row in table.rows)
    return text.getvalue()


def markdown_text(table: Table) -> str:
    """Format a table as Markdown, as GitHub shows it."""
    parts = [f'**{_markdown(table.title)}**']
    for columns in abreast(table.columns):
        heads = [f'{table.columns[index].group} {table.columns[index].head}'.strip() for index in columns]
        is_number = [is_number_column(table, index) for index in columns]
        lines = [_markdown_row(heads), _markdown_row('---:' if right else ':---' for right in is_number)]
        lines += [_markdown_row(rounded(row[index], '–') for index in columns) for row in table.rows]
        parts.append('\n'.join(lines))
    parts.append('\n'.join(f'- {_markdown(note)}' for note in table.notes))
    return '\n\n'.join(part for part in parts if part) + '\n'


WRITERS: Dict[str, Callable[[Table], str]] = {'csv': csv_text, 'md': markdown_text, 'tex': latex_text}


def write_tables(tables: Sequence[Table], csv_only: Sequence[Table], folder: Path) -> None:
    """Write tables in each format, and others as CSV only, into `folder`, which is created.

    Raises:
        OSError: a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = [(table, suffix) for table in tables for suffix in WRITERS]
    files += [(table, 'csv') for table in csv_only]
    for table, suffix in files:
        # Bytes: the same line ends on every system.
        (folder / f'{table.name}.{suffix}').write_bytes(WRITERS[suffix](table).encode('utf-8'))


def _exact(entry: Entry) -> str:
    if not isinstance(entry, Number):
        return text_cell(entry.name if isinstance(entry, Label) else entry)
    if entry.value is None:
        return ''
    return repr(float(entry.value) if entry.decimals else int(entry.value))


def _markdown(text: str) -> str:
    for char in '\\|_*<':
        text = text.replace(char, f'\\{char}')
    return text


def _markdown_row(texts: Iterable[str]) -> str:
    return f'| {" | ".join(map(_markdown, texts))} |'
