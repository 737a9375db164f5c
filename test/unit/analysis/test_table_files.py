"""What each format makes of a table."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table
from diff_encoder_sim.analysis.table_files import (
    Column,
    Label,
    Number,
    Table,
    csv_text,
    latex_text,
    markdown_text,
    write_tables,
)
from synthetic_trials import synthetic_dataset

TABLE_4, TABLE_5 = GOAL_TABLES[:2]


def written(folder, *tables, csv_only=()):
    """Contents of the files, by name."""
    write_tables(tables, csv_only, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_csv_has_all_digits():
    value = 0.1 + 0.2
    table = Table('t', 'title', [Column('x_m', 'x [m]')], [[Number(value, 3)]], [])
    assert csv_text(table) == f'x_m\n{value!r}\n'


def test_numpy_numbers_do_not_show():
    table = Table(
        't',
        'title',
        [Column('x_m', 'x [m]'), Column('n', 'n')],
        [[Number(np.float64(0.5), 3), Number(np.int64(3), 0)]],
        [],
    )
    assert csv_text(table) == 'x_m,n\n0.5,3\n'


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


def test_markdown():
    assert markdown_text(small_table()) == (
        '**Of a\\_b**\n\n| key | group 0 x | group 0 y |\n| :--- | ---: | ---: |\n'
        '| 100 % a\\_b | 0.000 | 0.000 |\n| a\\_b | – | – |\n\n- note on a\\_b\n'
    )


def test_a_wide_table_continues_below():
    text = markdown_text(small_table(groups=9))
    assert text.count('| key |') == 3 and text.count('group 8 x') == 1
    assert all(len({line.count('|') for line in part.split('\n')}) == 1 for part in text.split('\n\n')[1:-1])
    assert latex_text(small_table(groups=9)).count(r'\begin{tabular}') == 3


@pytest.mark.parametrize('text', ['a_b', '50 %', '$x$', 'a & b', '#1', '{x}', 'a\\b', '~', '^'])
def test_latex_escapes(text):
    lines = latex_text(small_table(text=text)).split('\n')
    rows = [line for line in lines if line.endswith(r'\\')]
    assert all(line.replace(r'\&', '').count('&') in (1, 2) for line in rows) and len(rows) == 4
    assert all(char not in '\n'.join(lines[1:]).replace(rf'\{char}', '') for char in '%#_')


def test_latex_environments_are_balanced_and_tests_are_ruled_off():
    text = latex_text(goal_table(synthetic_dataset(trials=2), TABLE_4))
    for environment in ('table', 'tabular'):
        assert text.count(rf'\begin{{{environment}}}') == text.count(rf'\end{{{environment}}}') == 1
    assert text.count(r'\midrule') == 3 and text.count('{') == text.count('}')
    assert r'\multicolumn{3}{c}{40 PPR}' in text and r'\cmidrule(lr){3-5}' in text
    assert '$-$0.' in text


def test_a_table_is_written_in_each_format_or_as_csv_alone(tmp_path):
    files = written(tmp_path, small_table(), csv_only=[small_table()._replace(name='long')])
    assert sorted(files) == ['long.csv', 'small.csv', 'small.md', 'small.tex']
    assert files['small.csv'] == files['long.csv'] and files['long.csv'].startswith(b'key,0x,0y\n')
