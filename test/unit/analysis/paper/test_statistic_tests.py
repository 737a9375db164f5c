"""One statistic of ours against the paper's, as far as the paper prints it."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paired_statistics import holm
from diff_encoder_sim.analysis.paper.comparison import COMPARISONS, compare_max, compare_pct_within, compare_std
from diff_encoder_sim.analysis.quantities import YAW, X


def test_equal_spreads_agree_whatever_the_rounding():
    values = np.array([-1.0, 1.0] * 15) * 0.0332 * math.sqrt(29.0 / 30.0)
    agreement = compare_std(values, 0.033, X)
    assert agreement.ours == pytest.approx(0.0332)
    assert agreement.p_value == 1.0


def test_spreads_by_the_f_test():
    values = np.array([-1.0, 1.0] * 15) * math.sqrt(29.0 / 30.0)  # a spread of 1
    theirs = 1.5 - 0.0005  # the nearest that rounds so
    expected = 2.0 * stats.f(29, 29).cdf(1.0 / theirs**2)
    agreement = compare_std(values, 1.5, YAW)
    assert agreement.p_value == pytest.approx(expected)
    assert 0.03 < expected < 0.04  # 0.80 to 1.34


def test_a_spread_inside_both_errors_may_be_outside_our_interval():
    values = np.array([-1.0, 1.0] * 15) * math.sqrt(29.0 / 30.0)
    agreement = compare_std(values, 1.4, YAW)
    assert agreement.p_value > 0.05


def test_a_spread_that_prints_as_zero():
    assert compare_std(np.array([0.0, 0.0]), 0.0, X).p_value == 1.0
    assert compare_std(np.array([0.0003, -0.0003]), 0.0, X).p_value == 1.0
    assert compare_std(np.array([0.0, 0.0]), 0.014, X).p_value == 0.0
    assert compare_std(np.array([0.1]), 0.014, X) is None


def test_per_cents_by_fishers_test():
    values = np.array([0.0] * 4 + [1.0] * 6)
    agreement = compare_pct_within(values, 90.0, X)
    assert agreement.ours == 40.0
    assert agreement.p_value == pytest.approx(stats.fisher_exact([[4, 6], [27, 3]])[1])
    assert agreement.interval.low < 40.0 < agreement.interval.high
    assert compare_pct_within(np.array([]), 90.0, X) is None


def test_a_minimum_is_a_maximum_of_the_opposite():
    values = np.random.default_rng(1).standard_normal(30)
    for printed in (-9.0, -2.0, 0.0):
        low, high = COMPARISONS['min'](values, printed, YAW), COMPARISONS['max'](-values, -printed, YAW)
        assert (low.ours, low.p_value) == (-high.ours, high.p_value)
        assert low.interval == (-high.interval.high, -high.interval.low)


def test_extremes_are_tested_on_both_sides_and_to_the_printed_digit():
    values = np.random.default_rng(2).standard_normal(30)
    assert compare_max(values, 9.0, YAW).p_value < 0.05 and compare_max(values, -1.0, YAW).p_value < 0.05
    tiny = 1e-4 * values
    assert compare_max(tiny, 0.0, X).p_value > 0.05 and compare_max(tiny, 0.02, X).p_value < 0.05


@pytest.mark.heavy
@pytest.mark.parametrize(
    'draw', [lambda rng: rng.standard_normal(30), lambda rng: rng.uniform(-2.0, 2.0, 30)], ids=['normal', 'uniform']
)
def test_families_of_equal_robots_are_rarely_contradicted(draw):
    """A family is 12 cells of 4 statistics, the paper's of its own 30 trials: in one of twenty at most one differs."""
    rng, quantity = np.random.default_rng(3), YAW._replace(tolerance=1.0)
    families = [
        [
            COMPARISONS[statistic](ours, printed, quantity).p_value
            for ours, theirs in ((draw(rng), draw(rng)) for _ in range(12))
            for statistic, printed in (
                ('min', theirs.min()),
                ('max', theirs.max()),
                ('std', theirs.std(ddof=1)),
                ('pct_within', 100.0 * np.mean(np.abs(theirs) <= 1.0)),
            )
        ]
        for _ in range(60)
    ]
    assert np.mean([p_value < 0.05 for family in families for p_value in family]) <= 0.05
    assert np.mean([min(holm(family)) < 0.05 for family in families]) <= 0.05
