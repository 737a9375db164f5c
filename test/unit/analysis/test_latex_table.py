"""LaTeX of a table."""

import pytest

from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table
from diff_encoder_sim.analysis.table import latex_text
from synthetic_trials import synthetic_dataset
from table_records import small_table

TABLE_4, TABLE_5 = GOAL_TABLES[:2]


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
