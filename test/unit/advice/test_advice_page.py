"""The page of an advice and the data of its charts."""

import json
import re

import pytest

from advised_robots import straight_advice, whole_advice
from diff_encoder_sim.advice.advice_charts import advice_charts
from diff_encoder_sim.advice.advice_page import write_page


def page_of(advice, folder):
    write_page(advice, folder / 'advice.html')
    return (folder / 'advice.html').read_text(encoding='utf-8')


def rows_with(column, advice):
    """The rows of the charts' data that has a column."""
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', advice_charts(advice), re.DOTALL)
    [columns] = [each for each in json.loads(content)['data'].values() if column in each]
    return [dict(zip(columns, row)) for row in zip(*columns.values())]


def test_the_page_has_answers_charts_and_tables(tmp_path):
    page = page_of(whole_advice(), tmp_path)
    assert '<title>Which encoder for alto?</title>' in page
    assert '<dt>true pose at the goal</dt><dd>at least 40 counts per revolution; 28 do not suffice</dd>' in page
    assert 'id="chart-share"' in page and 'id="chart-budget"' in page
    assert 'Encoders on these wheels' in page and '34 closed-loop trials' in page
    assert len(page) < 3_000_000


def test_it_loads_nothing_from_elsewhere(tmp_path):
    page = page_of(straight_advice(), tmp_path).replace('http://www.w3.org/', '')
    assert 'src="http' not in page and 'href="http' not in page


@pytest.mark.heavy
def test_bars_of_an_encoder_add_up_to_the_root_mean_square():
    advice = whole_advice()
    rows = [row for row in rows_with('rms', advice) if row['criterion'] == 'odometry' and row['axis'] == 'across']
    for counts, budget in advice.budgets['SL'].items():
        rms_mm = 1e3 * (budget.found.bias[1] ** 2 + budget.found.variance[1]) ** 0.5
        assert sum(row['rms'] for row in rows if row['counts'] == counts) == pytest.approx(rms_mm, rel=0.05)
