"""Intervals of one sample: scipy and hand as the reference, coverage by simulation, the edges."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.sample_statistics import (
    bootstrap_std_interval,
    mean_interval,
    spread,
    std_interval,
    wilson,
)
from simulated_samples import DRAWS, TRIALS, fraction_covering, is_near

INFINITY = math.inf


@pytest.mark.parametrize(('within', 'trials'), [(0, 30), (7, 30), (29, 30), (30, 30), (1, 1), (999, 1000)])
def test_wilson_is_the_root_of_its_quadratic_equation(within, trials):
    """Both bounds p solve (fraction - p)^2 = z^2 p (1 - p) / n, or are the end of the range."""
    z = stats.norm.ppf(0.975)
    for bound in wilson(within, trials):
        assert (within / trials - bound) ** 2 == pytest.approx(z**2 * bound * (1.0 - bound) / trials, abs=1e-12)


@pytest.mark.parametrize('fraction', [0.1, 0.5, 0.95])
def test_wilson_covers_as_its_binomial_sum_says(fraction):
    chances = stats.binom.pmf(np.arange(TRIALS + 1), TRIALS, fraction)
    covering = [
        interval.low <= fraction <= interval.high for interval in (wilson(count, TRIALS) for count in range(TRIALS + 1))
    ]
    assert 0.92 < chances[covering].sum() < 0.98


def test_mean_interval_is_students_t():
    values = np.array([0.1, -0.2, 0.4, 0.3])
    assert mean_interval(values, 0.9) == pytest.approx(stats.t.interval(0.9, 3, np.mean(values), stats.sem(values)))


def test_std_interval_by_the_chi_square_table():
    """Quantiles for 29 degrees of freedom: 16.047 and 45.722."""
    values = np.random.default_rng(1).normal(0.0, 0.3, TRIALS)
    std = np.std(values, ddof=1)
    assert std_interval(values) == pytest.approx((std * math.sqrt(29 / 45.722), std * math.sqrt(29 / 16.047)), rel=1e-4)


@pytest.mark.parametrize(('interval', 'truth'), [(std_interval, 2.0), (mean_interval, 7.0)])
@pytest.mark.parametrize('trials', [2, 30])
def test_exact_intervals_cover_at_their_level(interval, truth, trials):
    samples = np.random.default_rng(2).normal(7.0, 2.0, (1000, trials))
    assert is_near(fraction_covering([interval(sample, 0.9) for sample in samples], truth), 0.9, 1000)


@pytest.mark.parametrize(('draw', 'lowest'), [('normal', 0.90), ('uniform', 0.91), ('laplace', 0.88)])
def test_the_bootstrap_covers_nearly_at_its_level_whatever_the_distribution(draw, lowest):
    rng = np.random.default_rng(3)
    intervals = [bootstrap_std_interval(DRAWS[draw](rng, TRIALS), 0.95, rng, resamples=500) for _ in range(400)]
    assert lowest < fraction_covering(intervals, 1.0) < 0.985


def test_equal_seeds_give_equal_bootstraps_and_scale_passes_through():
    values = np.random.default_rng(5).normal(0.0, 1.0, TRIALS)
    once, again, scaled = (
        bootstrap_std_interval(scale * values + offset, 0.95, np.random.default_rng(6))
        for scale, offset in ((1.0, 0.0), (1.0, 0.0), (3.0, 11.0))
    )
    assert once == again
    assert scaled == pytest.approx((3.0 * once.low, 3.0 * once.high))


@pytest.mark.parametrize(
    ('values', 'mean', 'std', 'bootstrap'),
    [
        ([], (-INFINITY, INFINITY), (0.0, INFINITY), (0.0, INFINITY)),
        ([0.1], (-INFINITY, INFINITY), (0.0, INFINITY), (0.0, INFINITY)),
        ([0.1] * 30, (0.1, 0.1), (0.0, 0.0), (0.0, 0.0)),
        ([0.0] * 30, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
    ],
)
def test_samples_without_a_spread(values, mean, std, bootstrap):
    values = np.array(values)
    assert mean_interval(values) == pytest.approx(mean)
    assert std_interval(values) == std
    assert bootstrap_std_interval(values, 0.95, np.random.default_rng(0)) == bootstrap


def test_spread():
    assert spread(np.array([])) is None and spread(np.array([1.0])) is None
    assert spread(np.full(30, 0.1)) == 0.0  # numpy says 1.4e-17
    assert spread(np.array([1.0, 3.0])) == pytest.approx(math.sqrt(2.0))
    assert wilson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize(
    'values',
    [
        [0.0] * 29 + [2.25],
        [0.0] * 15 + [2.25] * 15,
        [0.0] * 28 + [2.25] * 2,
        [0.0, 0.0, 0.0, 0.0, 1.0],
        [1e-300, 2e-300, 3e-300, 4e-300, 5e-300],
    ],
)
def test_whole_pulses_give_intervals_that_hold_the_spread(values):
    interval = bootstrap_std_interval(np.array(values), 0.95, np.random.default_rng(0))
    assert 0.0 <= interval.low <= interval.high and not any(map(math.isnan, interval))
