"""CSV and Markdown of a table, and the files that are written."""

import numpy as np

from diff_encoder_sim.analysis.table import (
    Column,
    Label,
    Number,
    Table,
    csv_text,
    latex_text,
    markdown_text,
    write_tables,
)
from table_records import small_table


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


def test_no_cell_of_csv_is_a_formula_of_a_spreadsheet():
    columns = [Column('=a', 'a'), Column('x_m', 'x [m]'), Column('y_m', 'y [m]')]
    table = Table('t', 'title', columns, [[Label('=1+1', 'shown'), '@b', Number(-0.5, 1)]], [])
    assert csv_text(table) == "'=a,x_m,y_m\n'=1+1,'@b,-0.5\n"


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


def test_a_table_is_written_in_each_format_or_as_csv_alone(tmp_path):
    files = written(tmp_path, small_table(), csv_only=[small_table()._replace(name='long')])
    assert sorted(files) == ['long.csv', 'small.csv', 'small.md', 'small.tex']
    assert files['small.csv'] == files['long.csv'] and files['long.csv'].startswith(b'key,0x,0y\n')
