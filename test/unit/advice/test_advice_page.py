"""The page of an advice and the data of its charts."""

import numpy as np
import pytest

from advised_robots import straight_advice, whole_advice
from diff_encoder_sim.advice.advice_chart_data import chart_data
from diff_encoder_sim.advice.advice_page import write_page


def page_of(advice, folder):
    write_page(advice, folder / 'advice.html')
    return (folder / 'advice.html').read_text(encoding='utf-8')


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
    rows = [row for row in chart_data(advice)['budget'] if row['criterion'] == 'odometry' and row['axis'] == 'across']
    for counts, budget in advice.budgets['SL'].items():
        rms_mm = 1e3 * (budget.found.bias[1] ** 2 + budget.found.variance[1]) ** 0.5
        assert sum(row['rms'] for row in rows if row['counts'] == counts) == pytest.approx(rms_mm, rel=0.05)


def test_the_closed_form_is_within_a_few_draws_of_the_curve():
    data = chart_data(straight_advice())
    drawn, closed = ([(row['counts'], row['share']) for row in data[name]] for name in ('curves', 'closed'))
    shares = np.interp(np.log([counts for counts, _ in drawn]), *zip(*((np.log(c), share) for c, share in closed)))
    assert len(closed) > 50
    assert shares == pytest.approx([share for _, share in drawn], abs=0.06)
