import json

import numpy as np
import pytest

from advised_robots import straight_advice, whole_advice
from diff_encoder_sim.advice.advice_chart_data import chart_data


@pytest.mark.heavy
def test_bars_of_an_encoder_add_up_to_the_root_mean_square():
    advice = whole_advice()
    rows = [row for row in chart_data(advice)['budget'] if row['criterion'] == 'odometry' and row['axis'] == 'across']
    for counts, budget in advice.budgets['SL'].items():
        rms_mm = 1e3 * (budget.found.bias[1] ** 2 + budget.found.variance[1]) ** 0.5
        assert sum(row['rms'] for row in rows if row['counts'] == counts) == pytest.approx(rms_mm, rel=0.05)


def test_dots_have_the_interval_of_their_share():
    rows = chart_data(whole_advice())['trials']
    assert rows and all(row['low'] <= row['share'] <= row['high'] for row in rows)
    assert rows[0]['trials'] == '12 of 17'


def test_the_closed_form_is_within_a_few_draws_of_the_curve():
    data = chart_data(straight_advice())
    drawn, closed = ([(row['counts'], row['share']) for row in data[name]] for name in ('curves', 'closed'))
    shares = np.interp(np.log([counts for counts, _ in drawn]), *zip(*((np.log(c), share) for c, share in closed)))
    assert len(closed) > 50
    assert shares == pytest.approx([share for _, share in drawn], abs=0.06)


def test_lines_cover_the_whole_range_of_counts():
    data = chart_data(straight_advice())
    assert {row['counts'] for row in data['curves']} >= {8.0, 65536.0}
    assert {row['line'] for row in data['errors']} == {'half', '80 %', '95 %'}
    assert all(row['error'] > 0.0 for row in data['errors'])
    assert data['trials'] == data['encoders'] == data['budget'] == []
    json.dumps(data, allow_nan=False)
