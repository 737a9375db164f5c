"""P-values of one reported number, against chances worked out by hand and by simulation."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper.comparison import maximum_interval, maximum_p_value, spread_p_value
from diff_encoder_sim.analysis.sample_statistics import Interval

LEVEL = 0.95


def p_of(values, reported, count=30):
    return maximum_p_value(np.asarray(values, dtype=float), Interval(reported, reported), count)


def test_spreads_by_the_f_test_where_tails_are_light():
    values = np.array([-1.0, 1.0] * 15) * math.sqrt(29.0 / 30.0)  # a spread of 1
    assert spread_p_value(values, 1.5, 30) == pytest.approx(2.0 * stats.f(29, 29).cdf(1.0 / 1.5**2))
    assert spread_p_value(values, 1.0, 30) == pytest.approx(1.0) and spread_p_value(np.zeros(3), 0.1, 30) == 0.0


def test_heavy_tails_make_a_spread_less_sure():
    values = np.array([0.0] * 28 + [-1.0, 1.0])
    spread, excess = values.std(ddof=1), stats.kurtosis(values, bias=False)
    degrees = 29.0 / (1.0 + 0.5 * excess)
    assert spread_p_value(values, 2.0 * spread, 30) == pytest.approx(2.0 * stats.f(degrees, degrees).cdf(0.25))


def test_a_maximum_below_many_of_ours_is_one_of_the_orders_of_both():
    # All of our three above all of their thirty: one of C(33, 3) = 5456 orders, two-sided.
    assert p_of([2.0, 3.0, 4.0], 1.0) == pytest.approx(2.0 / 5456.0)


def test_a_maximum_just_beyond_ours_is_as_likely_as_not():
    assert p_of(np.linspace(0.0, 1.0, 30), 1.0 + 1e-9) == pytest.approx(1.0, abs=1e-6)


def test_beyond_ours_the_tail_is_exponential():
    """The chance that theirs lies so many estimated scales beyond ours, counted over exponential samples."""
    rng = np.random.default_rng(4)
    ours, theirs = rng.exponential(size=(2, 4000, 30))
    assert np.mean([p_of(a, b.max()) < 0.05 and b.max() > a.max() for a, b in zip(ours, theirs)]) == pytest.approx(
        0.025, abs=0.006
    )


@pytest.mark.parametrize(
    'draw',
    [
        lambda rng, size: rng.standard_normal(size),
        lambda rng, size: rng.uniform(-1.0, 1.0, size),
        lambda rng, size: np.round(rng.standard_normal(size)),  # whole pulses
    ],
    ids=['normal', 'uniform', 'whole pulses'],
)
def test_equal_distributions_rarely_differ(draw):
    rng = np.random.default_rng(5)
    p_values = [p_of(ours, theirs.max()) for ours, theirs in draw(rng, (1000, 2, 30))]
    assert np.mean([p_value is not None and p_value < 0.05 for p_value in p_values]) < 0.05


def test_far_off_on_either_side_is_found():
    values = np.random.default_rng(6).standard_normal(30)
    assert p_of(values, 10.0) < 0.001 and p_of(values, 0.0) < 0.001


def test_more_of_ours_make_a_maximum_that_few_exceed_unlikely():
    values = np.arange(2000.0)
    assert p_of(values, 2500.0, count=3) < 0.05 and p_of(values, 1998.5, count=3) < 0.05
    assert p_of(values, 1500.0, count=3) > 0.2


@pytest.mark.parametrize('ours', [2, 5, 30, 400])
def test_the_interval_is_what_is_not_rejected(ours):
    values = np.random.default_rng(ours).standard_normal(ours)
    low, high = maximum_interval(values, 30, LEVEL)
    step = 1e-6
    assert p_of(values, low + step) >= 0.05 > p_of(values, low - step) if low > -math.inf else True
    assert p_of(values, high - step) >= 0.05 > p_of(values, high + step)


def test_too_few_or_equal_values_leave_a_side_open():
    assert p_of([1.0], 80.0) is None and p_of([1.0, 1.0, 1.0], 80.0) is None
    assert maximum_interval(np.array([1.0]), 30, LEVEL) == (-math.inf, math.inf)
