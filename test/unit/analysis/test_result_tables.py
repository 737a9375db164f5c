"""A table as CSV, Markdown, LaTeX and on a page."""

import numpy as np
import pandas as pd
import pytest

from diff_encoder_sim.analysis import result_tables
from diff_encoder_sim.analysis.result_tables import Column, ResultTable, html_table, latex_text, markdown_text


def small_table(groups=1, text='a_b', name='small'):
    columns = {f'{group}{axis}': Column(axis, f'group {group}', 3) for group in range(groups) for axis in 'xy'}
    frame = pd.DataFrame({'key': [f'100 % {text}', text], **{name: [-0.0004, None] for name in columns}}, dtype=object)
    return ResultTable(name, f'Of {text}', frame, columns, [f'note on {text}'])


def test_csv_has_all_digits_and_whole_numbers():
    value = 0.1 + 0.2
    rows = [['a, b', value, np.int64(3), None, np.inf], ['c', np.float64(-0.5), None, 1.0, 0.0]]
    exact = pd.DataFrame(rows, columns=['key', 'x_m', 'n', 'none', 'most'], dtype=object)
    text = result_tables.csv_text(ResultTable('t', 'title', exact))
    assert text == f'key,x_m,n,none,most\n"a, b",{value!r},3,,inf\nc,-0.5,,1.0,0.0\n'


def test_markdown():
    lines = [line.replace(' ', '') for line in markdown_text(small_table()).split('\n')]
    assert lines[0] == '**Ofa\\_b**' and lines[-2] == '-noteona\\_b'
    assert lines[2] == '|key|group0x|group0y|' and lines[4:6] == ['|100%a\\_b|0.000|0.000|', '|a\\_b|–|–|']


def test_a_wide_table_continues_below():
    wide = small_table(groups=9)
    assert markdown_text(wide).count('| key ') == 3 and markdown_text(wide).count('group 8 x') == 1
    assert latex_text(wide).count(r'\begin{tabular}') == 3 and len(html_table(wide)) == 3


@pytest.mark.parametrize('text', ['a_b', '50 %', '$x$', 'a & b', '#1', '{x}', 'a\\b', '~', '^'])
def test_latex_escapes(text):
    lines = latex_text(small_table(text=text)).split('\n')
    rows = [line for line in lines if line.endswith(r'\\')]
    assert all(line.replace(r'\&', '').count('&') in (1, 2) for line in rows) and len(rows) == 4
    assert all(char not in '\n'.join(lines[1:]).replace(rf'\{char}', '') for char in '%#_')


def test_on_a_page_numbers_are_rounded_missing_ones_are_dashes_and_labels_are_texts():
    exact = pd.DataFrame([['SL', 'x_m', 0.12345, None]], columns=['test', 'quantity', 'x_m', 'y_m'], dtype=object)
    columns = {'x_m': Column('x [m]', '40 PPR', [3]), 'y_m': Column('y [m]', '40 PPR', 3)}
    [block] = html_table(ResultTable('t', 'A table', exact, columns))
    assert block['rows'] == [['SL', 'x [m]', '0.123', '–']]
    assert block['heads'] == [('test', False), ('error', False), ('x [m]', True), ('y [m]', True)]
    assert block['groups'] == [('', 2), ('40 PPR', 2)] and block['keys'] == 2
