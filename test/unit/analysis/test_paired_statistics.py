"""Statistics of pairs."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis import paired_statistics as pairwise_means
from diff_encoder_sim.analysis.paired_statistics import holm, mcnemar, mean_of_rank, spread_ratio, wilcoxon
from diff_encoder_sim.analysis.sample_statistics import Interval
from simulated_samples import DRAWS, TRIALS, chance_range, fraction_covering

INFINITY = math.inf


def pairs_with(rng, draw, ratio, repetitions=1000, trials=TRIALS, shared=0.5):
    """(repetitions, 2, trials); both with the same distribution but for the ratio of their spreads."""
    common = DRAWS[draw](rng, (repetitions, 1, trials))
    own = DRAWS[draw](rng, (repetitions, 2, trials))
    return (math.sqrt(shared) * common + math.sqrt(1.0 - shared) * own) * np.array([[ratio], [1.0]])


def fraction_significant(test, pairs):
    return np.mean([test(*pair).p_value <= 0.05 for pair in pairs])


@pytest.mark.heavy
@pytest.mark.parametrize('draw', list(DRAWS))
def test_the_ratio_of_spreads_has_its_size_and_coverage_whatever_the_distribution(draw):
    pairs = pairs_with(np.random.default_rng(7), draw, 1.0)
    assert 0.01 < fraction_significant(spread_ratio, pairs) <= 0.05
    pairs *= np.array([[5.0], [1.0]])
    lowest = 0.85 if draw == 'contaminated' else 0.905
    assert lowest < fraction_covering([spread_ratio(*pair).interval for pair in pairs], 5.0) < 0.985


def test_an_interval_leaves_out_equality_when_its_test_is_significant():
    for pair in pairs_with(np.random.default_rng(10), 'normal', 1.3, 200):
        result = wilcoxon(*pair)
        assert (result.interval.low <= 0.0 <= result.interval.high) == (result.p_value > 0.05)
        result = spread_ratio(*pair)
        assert result.p_value > 0.05 or not result.interval.low <= 1.0 <= result.interval.high


def test_swapped_samples_give_the_inverse_ratio_and_offsets_do_not_matter():
    first, second = pairs_with(np.random.default_rng(12), 'laplace', 2.0, 1)[0]
    one, other = spread_ratio(first, second), spread_ratio(second + 3.0, first - 7.0)
    assert other.p_value == pytest.approx(one.p_value)
    assert other.estimate == pytest.approx(1.0 / one.estimate)
    assert other.interval == pytest.approx((1.0 / one.interval.high, 1.0 / one.interval.low))


ONE_OFF = np.array([0.0] * 29 + [2.25])
VARIED = np.random.default_rng(13).normal(0.0, 1.0, 30)


@pytest.mark.parametrize(
    ('first', 'second', 'estimate', 'p_value'),
    [
        (VARIED, np.zeros(30), INFINITY, 2.0**-29),  # all signs alike: one chance in 2^30 a side
        (np.full(30, 0.1), VARIED, 0.0, 2.0**-29),
        (np.full(30, 0.1), np.zeros(30), 1.0, 1.0),
        (VARIED[:2], VARIED[2:4], None, 1.0),
        (VARIED[:1], VARIED[:1], 1.0, 1.0),
        ([], [], 1.0, 1.0),
    ],
)
def test_ratios_of_samples_without_a_spread_or_too_small(first, second, estimate, p_value):
    result = spread_ratio(np.array(first), np.array(second))
    assert estimate is None or result.estimate == estimate
    assert result.interval == (0.0, INFINITY)
    assert result.p_value == pytest.approx(p_value)


def test_equal_and_proportional_samples():
    assert spread_ratio(VARIED, VARIED).p_value == 1.0
    assert spread_ratio(VARIED, -VARIED).p_value == 1.0
    assert spread_ratio(2.0 * VARIED, VARIED).p_value < 2e-9
    assert spread_ratio(2.0 * VARIED, VARIED).interval == pytest.approx((2.0, 2.0), rel=1e-4)


@pytest.mark.parametrize('pairs', [3, 10, 30, 50])
def test_wilcoxon_without_ties_is_scipys_exact_one(pairs):
    first, second = np.random.default_rng(pairs).normal(0.2, 1.0, (2, pairs))
    assert wilcoxon(first, second).p_value == pytest.approx(stats.wilcoxon(first, second).pvalue)


def test_wilcoxon_of_many_pairs_with_ties_is_scipys_approximation():
    first, second = np.random.default_rng(14).integers(0, 6, (2, 300)).astype(float)
    assert wilcoxon(first, second).p_value == pytest.approx(
        stats.wilcoxon(first, second, correction=False).pvalue, rel=1e-6
    )


def test_wilcoxon_with_ties_counts_all_signs():
    differences = np.array([1.0, 1.0, -1.0, 2.0, 2.0, 3.0, 3.0, 0.0])
    ranks = stats.rankdata(np.abs(differences[:7]))
    signs = 1 - 2 * (np.arange(128)[:, np.newaxis] >> np.arange(7) & 1)
    as_far = np.abs(signs @ ranks) >= abs(np.sign(differences[:7]) @ ranks)
    assert wilcoxon(differences, np.zeros(8)).p_value == pytest.approx(np.mean(as_far))


@pytest.mark.parametrize('pairs', [6, 30])
def test_wilcoxon_covers_at_its_level(pairs):
    differences = np.random.default_rng(15).laplace(0.3, 1.0, (600, pairs))
    intervals = [wilcoxon(row, np.zeros(pairs)).interval for row in differences]
    assert chance_range(0.95, 600)[0] <= fraction_covering(intervals, 0.3) <= 0.985


def test_the_interval_of_six_pairs_is_from_the_least_to_the_greatest_difference():
    differences = np.array([0.4, -0.1, 0.3, 0.9, 0.2, 0.5])
    result = wilcoxon(differences, np.zeros(6))
    assert result.interval == (-0.1, 0.9)
    assert result.estimate == pytest.approx(0.35)
    assert wilcoxon(differences[:5], np.zeros(5)).interval == (-INFINITY, INFINITY)


def test_wilcoxon_at_the_edges():
    assert wilcoxon([], []).p_value == 1.0 and wilcoxon([], []).interval == (-INFINITY, INFINITY)
    assert wilcoxon([1.0], [0.0]).p_value == 1.0
    assert wilcoxon(VARIED, VARIED) == (30, 0.0, Interval(0.0, 0.0), 1.0)
    one, other = wilcoxon(VARIED, ONE_OFF), wilcoxon(ONE_OFF, VARIED)
    assert other.estimate == pytest.approx(-one.estimate) and other.p_value == one.p_value


def test_mcnemar_is_the_coin_of_the_pairs_that_differ():
    """9 against 1 of 10: 2 (1 + 10) / 2^10."""
    first = np.array([True] * 9 + [False] + [True] * 10 + [False] * 10)
    second = np.array([False] * 9 + [True] + [True] * 10 + [False] * 10)
    result = mcnemar(first, second)
    assert result.p_value == pytest.approx(22 / 1024)
    assert result.estimate == pytest.approx(8 / 30)
    swapped = mcnemar(second, first)
    assert swapped.p_value == result.p_value and swapped.interval == pytest.approx(
        (-result.interval.high, -result.interval.low)
    )


@pytest.mark.parametrize(('only_first', 'only_second'), [(0.3, 0.1), (0.05, 0.05), (0.8, 0.0)])
def test_mcnemar_covers_the_difference_of_shares(only_first, only_second):
    kinds = np.random.default_rng(16).choice(
        3, (1000, TRIALS), p=[only_first, only_second, 1.0 - only_first - only_second]
    )
    results = [mcnemar(row == 0, row == 1) for row in kinds]
    assert 0.93 < fraction_covering([result.interval for result in results], only_first - only_second)
    if only_first == only_second:
        assert np.mean([result.p_value <= 0.05 for result in results]) <= 0.05


def test_holm_by_hand():
    """0.005 x 4, 0.01 x 3, 0.03 x 2, and 0.04 x 1 lifted to what stands before it."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]) == [] and holm([0.2]) == [0.2] and holm([0.9, 0.8]) == [1.0, 1.0]


def all_means(values):
    rows, columns = np.triu_indices(len(values))
    return np.sort(0.5 * (values[rows] + values[columns]))


@pytest.mark.heavy
@pytest.mark.parametrize('most_at_once', [10])
@pytest.mark.parametrize(
    'values',
    [
        np.random.default_rng(0).normal(size=40),
        0.1 * np.round(3.0 * np.random.default_rng(1).normal(size=60)),  # whole pulses: many are equal
        np.random.default_rng(2).standard_cauchy(size=30),
        np.zeros(20),
        np.array([1.5]),
    ],
    ids=['normal', 'whole pulses', 'heavy tails', 'equal', 'one'],
)
def test_every_rank_is_that_of_all_means_sorted(monkeypatch, values, most_at_once):
    monkeypatch.setattr(pairwise_means, 'MOST_AT_ONCE', most_at_once)
    ascending = np.sort(values)
    means = all_means(values)
    assert [mean_of_rank(ascending, rank) for rank in range(len(means))] == means.tolist()


@pytest.mark.heavy
@pytest.mark.parametrize('draw', ['normal', 'laplace', 'contaminated'])
def test_families_of_spreads_without_a_difference_stay_without_one(draw):
    """The far tail of the p-values: the smallest of 18, as often below 0.05 / 18 as Holm allows."""
    pairs = pairs_with(np.random.default_rng(18), draw, 1.0, 18 * 150, shared=0.0)
    p_values = np.reshape([spread_ratio(*pair).p_value for pair in pairs], (150, 18))
    assert np.mean([min(holm(family)) <= 0.05 for family in p_values]) < 0.06


def test_thirty_trials_tell_larger_spreads_apart():
    rng = np.random.default_rng(11)
    assert fraction_significant(spread_ratio, pairs_with(rng, 'normal', 1.6, 300)) > 0.5
    assert fraction_significant(spread_ratio, pairs_with(rng, 'uniform', 1.6, 300, shared=0.0)) > 0.7
    assert fraction_significant(spread_ratio, pairs_with(rng, 'laplace', 3.0, 300)) > 0.95


def test_a_spread_that_one_pulse_makes_has_no_interval():
    result = spread_ratio(VARIED, ONE_OFF)
    assert result.estimate == pytest.approx(np.std(VARIED) / np.std(ONE_OFF))
    assert result.interval == (0.0, INFINITY) and result.p_value < 0.05


def test_mcnemar_at_the_edges():
    nothing = np.array([], dtype=bool)
    assert mcnemar(nothing, nothing) == (0, 0.0, Interval(-1.0, 1.0), 1.0)
    equal = mcnemar(np.ones(30, dtype=bool), np.ones(30, dtype=bool))
    assert equal.p_value == 1.0 and equal.interval.low < 0.0 < equal.interval.high
    assert mcnemar(np.ones(30, dtype=bool), np.zeros(30, dtype=bool)).p_value == pytest.approx(2.0**-29)
