"""One statistic of ours against the paper's, by p-values worked out by hand."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper.statistic_tests import compare_max, compare_min, compare_pct_within, compare_std
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
    assert compare_std(values, 1.5, YAW).p_value == pytest.approx(expected)
    assert 0.03 < expected < 0.04


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


def test_extremes_by_the_order_of_both_samples():
    # All of our three above all of their thirty: one of C(33, 3) = 5456 orders, two-sided.
    assert compare_max(np.array([2.0, 3.0, 4.0]), 1.0, X).p_value == pytest.approx(2.0 / 5456.0)
    assert compare_min(np.array([-2.0, -3.0, -4.0]), -1.0, X).p_value == pytest.approx(2.0 / 5456.0)
    assert compare_min(np.array([-2.0, -3.0, -4.0]), -1.0, X).ours == -4.0


def test_an_extreme_beyond_ours_tells_nothing():
    assert compare_max(np.array([0.1, 0.2]), 80.0, X).p_value is None


def test_extremes_rarely_differ_by_chance():
    rng = np.random.default_rng(5)
    rejected = sum(
        (compare_max(ours, theirs.max(), YAW).p_value or 1.0) < 0.05
        for ours, theirs in rng.standard_normal((2000, 2, 30))
    )
    assert rejected / 2000 < 0.05


def test_equal_spreads_differ_by_chance_in_one_of_twenty():
    rng = np.random.default_rng(3)
    rejected = sum(
        compare_std(ours, theirs.std(ddof=1), YAW).p_value < 0.05 for ours, theirs in rng.standard_normal((500, 2, 30))
    )
    assert 0.03 < rejected / 500 < 0.07
