"""A table as CSV, Markdown, LaTeX and on a page."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.table import (
    Column,
    Label,
    Number,
    Table,
    csv_text,
    html_table,
    latex_text,
    markdown_text,
    write_tables,
)
from table_records import small_table

COLUMNS = [Column('test', 'test'), Column('x', 'x [m]', '40 PPR'), Column('y', 'y [m]', '40 PPR')]


def test_csv_has_all_digits_whole_numbers_and_no_formula_of_a_spreadsheet():
    value = 0.1 + 0.2
    names = ['=a', 'x_m', 'n', 'none', 'most']
    rows = [
        [Label('=1+1', 'shown'), Number(value, 3), Number(np.int64(3), 0), Number(None, 2), Number(np.inf, 2)],
        ['@b', Number(np.float64(-0.5), 1), Number(None, 0), Number(1.0, 2), Number(0.0, 2)],
    ]
    text = csv_text(Table('t', 'title', [Column(name, 'head') for name in names], rows, []))
    assert text == f"'=a,x_m,n,none,most\n'=1+1,{value!r},3,,inf\n'@b,-0.5,,1.0,0.0\n"


def test_markdown():
    lines = [line.replace(' ', '') for line in markdown_text(small_table()).split('\n')]
    assert lines[0] == '**Ofa\\_b**' and lines[-2] == '-noteona\\_b'
    assert lines[2] == '|key|group0x|group0y|' and lines[4:6] == ['|100%a\\_b|0.000|0.000|', '|a\\_b|–|–|']


def test_a_wide_table_continues_below():
    text = markdown_text(small_table(groups=9))
    assert text.count('| key ') == 3 and text.count('group 8 x') == 1
    assert latex_text(small_table(groups=9)).count(r'\begin{tabular}') == 3
    assert len(html_table(small_table(groups=9)).blocks) == 3


@pytest.mark.parametrize('text', ['a_b', '50 %', '$x$', 'a & b', '#1', '{x}', 'a\\b', '~', '^'])
def test_latex_escapes(text):
    lines = latex_text(small_table(text=text)).split('\n')
    rows = [line for line in lines if line.endswith(r'\\')]
    assert all(line.replace(r'\&', '').count('&') in (1, 2) for line in rows) and len(rows) == 4
    assert all(char not in '\n'.join(lines[1:]).replace(rf'\{char}', '') for char in '%#_')


def test_the_tables_of_the_paper_are_written_in_each_format_and_others_as_csv(tmp_path):
    write_tables([small_table(), small_table()._replace(name='table4')], tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ['small.csv', 'table4.csv', 'table4.md', 'table4.tex']
    assert (tmp_path / 'small.csv').read_bytes().startswith(b'key,0x,0y\n')


def test_on_a_page_numbers_are_rounded_and_missing_ones_are_dashes():
    table = html_table(Table('t', 'A table', COLUMNS, [['SL', Number(0.12345, 3), Number(None, 3)]], ['a note']))
    [block] = table.blocks
    assert [row.entries for row in block.rows] == [['SL', '0.123', '–']]
    assert [head.is_number for head in block.heads] == [False, True, True]
    assert block.groups == [('', 1), ('40 PPR', 2)] and block.keys == 1
