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


def test_the_closed_form_is_within_a_few_draws_of_the_curve():
    data = chart_data(straight_advice())
    drawn, closed = ([(row['counts'], row['share']) for row in data[name]] for name in ('curves', 'closed'))
    shares = np.interp(np.log([counts for counts, _ in drawn]), *zip(*((np.log(c), share) for c, share in closed)))
    assert len(closed) > 50
    assert shares == pytest.approx([share for _, share in drawn], abs=0.06)
