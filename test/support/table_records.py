"""Small tables, and tables as their CSV files read back."""

import csv
import io

from diff_encoder_sim.analysis.table import Column, Label, Number, Table, csv_text


def records(table):
    """Its CSV file, read back."""
    return list(csv.DictReader(io.StringIO(csv_text(table))))


def column(table, name, key='statistic'):
    return {row[key]: float(row[name]) if row[name] else None for row in records(table)}


def small_table(groups=1, text='a_b'):
    columns = [
        Column('key', 'key'),
        *(Column(f'{group}{name}', name, f'group {group}') for group in range(groups) for name in ('x', 'y')),
    ]
    return Table(
        'small',
        f'Of {text}',
        columns,
        [
            [Label(text, f'100 % {text}'), *[Number(-0.0004, 3)] * (2 * groups)],
            [text, *[Number(None, 3)] * (2 * groups)],
        ],
        [f'note on {text}'],
    )
