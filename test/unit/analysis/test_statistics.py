"""Statistics of one sample and of pairs: scipy and hand as the reference, coverage by simulation, the edges."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis import statistics
from diff_encoder_sim.analysis.statistics import holm, mcnemar, spread_ratio, wilcoxon, wilson

INFINITY = math.inf
TRIALS = 30
VARIED = np.random.default_rng(13).normal(0.0, 1.0, 30)
DRAWS = {  # of variance 1
    'normal': lambda rng, size: rng.normal(0.0, 1.0, size),
    'uniform': lambda rng, size: rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), size),
    'laplace': lambda rng, size: rng.laplace(0.0, math.sqrt(0.5), size),
}


def fraction_covering(intervals, truth):
    return np.mean([interval.low <= truth <= interval.high for interval in intervals])


@pytest.mark.parametrize(('within', 'trials'), [(0, 30), (7, 30), (30, 30)])
def test_wilson_is_the_root_of_its_quadratic_equation(within, trials):
    """Both bounds p solve (fraction - p)^2 = z^2 p (1 - p) / n, or are the end of the range."""
    z = stats.norm.ppf(0.975)
    for bound in wilson(within, trials):
        assert (within / trials - bound) ** 2 == pytest.approx(z**2 * bound * (1.0 - bound) / trials, abs=1e-12)


@pytest.mark.parametrize(
    ('values', 'mean', 'std'), [([], (-INFINITY, INFINITY), (0.0, INFINITY)), ([0.1] * 30, (0.1, 0.1), (0.0, 0.0))]
)
def test_samples_without_a_spread(values, mean, std):
    values = np.array(values)
    assert statistics.mean_interval(values) == pytest.approx(mean)
    assert statistics.std_interval(values) == std


@pytest.mark.parametrize('draw', list(DRAWS))
def test_the_ratio_of_spreads_has_its_size_and_coverage_whatever_the_distribution(draw):
    rng = np.random.default_rng(7)
    common, own = (DRAWS[draw](rng, (1000, count, TRIALS)) for count in (1, 2))  # half of each variance is shared
    pairs = math.sqrt(0.5) * (common + own)
    assert 0.01 < np.mean([spread_ratio(*pair).p_value <= 0.05 for pair in pairs]) <= 0.05
    pairs *= np.array([[5.0], [1.0]])
    assert 0.905 < fraction_covering([spread_ratio(*pair).interval for pair in pairs], 5.0) < 0.985


@pytest.mark.parametrize(
    ('first', 'second', 'estimate', 'p_value'),
    [
        (VARIED, np.zeros(30), INFINITY, 2.0**-29),  # all signs alike: one chance in 2^30 a side
        (np.full(30, 0.1), VARIED, 0.0, 2.0**-29),
        (np.full(30, 0.1), np.zeros(30), 1.0, 1.0),
        (VARIED[:2], 2.0 * VARIED[:2], 0.5, 1.0),
        ([], [], 1.0, 1.0),
    ],
)
def test_ratios_of_samples_without_a_spread_or_too_small(first, second, estimate, p_value):
    result = spread_ratio(np.array(first), np.array(second))
    assert (result.estimate, result.p_value) == pytest.approx((estimate, p_value))
    assert result.interval == (0.0, INFINITY)


@pytest.mark.parametrize('pairs', [3, 30, 50])
def test_wilcoxon_without_ties_is_scipys_exact_one(pairs):
    first, second = np.random.default_rng(pairs).normal(0.2, 1.0, (2, pairs))
    assert wilcoxon(first, second).p_value == pytest.approx(stats.wilcoxon(first, second).pvalue)


def test_wilcoxon_with_ties_counts_all_signs_and_of_many_pairs_is_scipys_approximation():
    differences = np.array([1.0, 1.0, -1.0, 2.0, 2.0, 3.0, 3.0, 0.0])
    ranks = stats.rankdata(np.abs(differences[:7]))
    signs = 1 - 2 * (np.arange(128)[:, np.newaxis] >> np.arange(7) & 1)
    as_far = np.abs(signs @ ranks) >= abs(np.sign(differences[:7]) @ ranks)
    assert wilcoxon(differences, np.zeros(8)).p_value == pytest.approx(np.mean(as_far))
    many = np.random.default_rng(14).integers(0, 6, (2, 300)).astype(float)
    assert wilcoxon(*many).p_value == pytest.approx(stats.wilcoxon(*many, correction=False).pvalue, rel=1e-6)


def test_wilcoxon_covers_at_its_level():
    differences = np.random.default_rng(15).laplace(0.3, 1.0, (600, TRIALS))
    intervals = [wilcoxon(row, np.zeros(TRIALS)).interval for row in differences]
    assert 0.92 < fraction_covering(intervals, 0.3) < 0.985


def test_the_interval_of_six_pairs_is_from_the_least_to_the_greatest_difference():
    differences = np.array([0.4, -0.1, 0.3, 0.9, 0.2, 0.5])
    result, reversed_result = (wilcoxon(*pair) for pair in ((differences, np.zeros(6)), (np.zeros(6), differences)))
    assert (result.interval, reversed_result.interval) == ((-0.1, 0.9), (-0.9, 0.1))
    assert result.estimate == pytest.approx(0.35) == pytest.approx(-reversed_result.estimate)
    assert wilcoxon(differences[:5], np.zeros(5)).interval == (-INFINITY, INFINITY)
    assert wilcoxon([], []) == (0, 0.0, (-INFINITY, INFINITY), 1.0) and wilcoxon([1.0], [0.0]).p_value == 1.0
    assert wilcoxon(VARIED, VARIED) == (30, 0.0, (0.0, 0.0), 1.0)


def test_mcnemar_is_the_coin_of_the_pairs_that_differ():
    """9 against 1 of 10: 2 (1 + 10) / 2^10."""
    first, second = (np.array([one] * 9 + [not one] + [True] * 10 + [False] * 10) for one in (True, False))
    result, swapped = mcnemar(first, second), mcnemar(second, first)
    assert result.p_value == swapped.p_value == pytest.approx(22 / 1024)
    assert result.estimate == pytest.approx(8 / 30)
    assert swapped.interval == pytest.approx((-result.interval.high, -result.interval.low))


@pytest.mark.parametrize(('only_first', 'only_second'), [(0.3, 0.1), (0.05, 0.05), (0.8, 0.0)])
def test_mcnemar_covers_the_difference_of_shares(only_first, only_second):
    shares = [only_first, only_second, 1.0 - only_first - only_second]
    kinds = np.random.default_rng(16).choice(3, (1000, TRIALS), p=shares)
    results = [mcnemar(row == 0, row == 1) for row in kinds]
    assert 0.93 < fraction_covering([result.interval for result in results], only_first - only_second)
    if only_first == only_second:
        assert np.mean([result.p_value <= 0.05 for result in results]) <= 0.05


def test_holm_by_hand():
    """0.005 x 4, 0.01 x 3, 0.03 x 2, and 0.04 x 1 lifted to what stands before it."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == [] and holm([0.2]) == [0.2] and holm([0.9, 0.8]) == [1.0, 1.0]


def test_spread_and_the_fraction_of_no_trials():
    assert statistics.spread(np.array([])) is None and statistics.spread(np.array([1.0])) is None
    assert statistics.spread(np.full(30, 0.1)) == 0.0  # numpy returns 1.4e-17
    assert statistics.spread(np.array([1.0, 3.0])) == pytest.approx(math.sqrt(2.0))
    assert wilson(0, 0) == (0.0, 1.0)
