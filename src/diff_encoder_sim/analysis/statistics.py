"""Statistics of one sample and of pairs of equal trials.

Spread is the standard deviation with n - 1. No result is NaN: for small samples intervals are as wide as the quantity
allows and p-values are 1. All p-values are two-sided, and all intervals of 95 % unless a level is given.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.quantities import LEVEL
from diff_encoder_sim.base.deferred import deferred

special = deferred('scipy.special')
stats = deferred('scipy.stats')

SIGNIFICANCE = 0.05  # level of all tests
LOWER, UPPER = 0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL  # quantiles of the intervals

MOST_PAIRS_EXACT = 100  # above, the normal approximation is used: at p = 0.05 it differs by 0.0001
ROUNDING = 1e-12  # relative tolerance for sums of squares that cancel to zero


class Interval(NamedTuple):
    """Closed interval."""

    low: float
    high: float


def spread(values: np.ndarray) -> Optional[float]:
    """Compute the standard deviation; None for fewer than two values, exactly 0 if all are equal."""
    if len(values) < 2:
        return None
    return float(np.std(values, ddof=1)) if np.ptp(values) > 0.0 else 0.0


def wilson(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Compute Wilson's score interval of a fraction; (0, 1) without trials."""
    if n == 0:
        return Interval(0.0, 1.0)
    z = float(special.ndtri(0.5 + 0.5 * level))  # not of scipy.stats: advise would import it for half a second
    share, width = successes / n, 2 * (n + z**2)
    middle, margin = (2 * n * share + z**2) / width, z / width * math.sqrt(4 * n * share * (1 - share) + z**2)
    return Interval(middle - margin if successes else 0.0, middle + margin if successes < n else 1.0)


def mean_interval(values: np.ndarray) -> Interval:
    """Compute Student's t interval of the mean; unbounded for fewer than two values."""
    std = spread(values)
    if std is None:
        return Interval(-math.inf, math.inf)
    margin = float(stats.t.ppf(UPPER, len(values) - 1)) * std / math.sqrt(len(values))
    return Interval(float(np.mean(values)) - margin, float(np.mean(values)) + margin)


def std_interval(values: np.ndarray) -> Interval:
    """Compute the chi-square interval of the spread of Gaussian values; (0, infinity) for fewer than two."""
    std, freedom = spread(values), len(values) - 1
    if std is None:
        return Interval(0.0, math.inf)
    low, high = stats.chi2.ppf(np.array([UPPER, LOWER]), freedom)
    return Interval(std * math.sqrt(freedom / low), std * math.sqrt(freedom / high))


class PairedResult(NamedTuple):
    """Difference between two samples of equal trials."""

    pairs: int
    estimate: float
    interval: Interval  # not corrected for multiple comparisons
    p_value: float  # of no difference, not corrected


def spread_ratio(first: np.ndarray, second: np.ndarray) -> PairedResult:
    """Estimate the spread of the first over that of the second, for pairs of any distribution.

    The interval is the jackknife of the log ratio (Miller 1968). The p-value is the larger of the jackknife and the
    signed ranks of squared deviations: outliers make the former too small, skewed values the latter. If the spread of a
    sample is zero or caused by one value, the interval is (0, infinity) and only the ranks are used; the ratio of two
    samples without a spread is 1.
    """
    pairs, std, other_std = len(first), spread(first), spread(second)
    if std == other_std or std is None or other_std is None:
        ratio = 1.0
    else:
        ratio = std / other_std if other_std > 0.0 else math.inf
    if pairs < 3:
        return PairedResult(pairs, ratio, Interval(0.0, math.inf), 1.0)
    squares = [np.square(values - np.mean(values)) if spread(values) else np.zeros(pairs) for values in (first, second)]
    # Sums of squares about the mean, each without one pair.
    without = [np.sum(square) - square * pairs / (pairs - 1) for square in squares]
    p_value = signed_rank_p(squares[0] - squares[1])
    if any((left <= ROUNDING * np.sum(square)).any() for left, square in zip(without, squares)):
        return PairedResult(pairs, ratio, Interval(0.0, math.inf), p_value)
    pseudo_values = pairs * math.log(ratio) - (pairs - 1) * 0.5 * np.log(without[0] / without[1])
    low, high = mean_interval(pseudo_values)
    mean, error = float(np.mean(pseudo_values)), (spread(pseudo_values) or 0.0) / math.sqrt(pairs)
    if mean == 0.0:
        p_value = 1.0
    elif error > 0.0:
        p_value = max(p_value, float(2.0 * stats.t.sf(abs(mean) / error, pairs - 1)))
    return PairedResult(pairs, ratio, Interval(math.exp(low), math.exp(high)), p_value)


def wilcoxon(first: np.ndarray, second: np.ndarray) -> PairedResult:
    """Estimate the shift of the first against the second by the signed-rank test with ties.

    The estimate is that of Hodges and Lehmann (median of the pairwise means of differences), with the interval of the
    test. Pairs without a difference are used in both, but not in the p-value.
    """
    differences = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    pairs = len(differences)
    if pairs == 0:
        return PairedResult(0, 0.0, Interval(-math.inf, math.inf), 1.0)
    ascending = np.sort(differences)
    means = 0.5 * (ascending[:, np.newaxis] + ascending)[np.triu_indices(pairs)]
    # Pairwise means outside each bound of the interval; 0 if it is unbounded.
    if pairs > MOST_PAIRS_EXACT:
        std = math.sqrt(pairs * (pairs + 1) * (2 * pairs + 1) / 24.0)
        beyond = int(0.25 * pairs * (pairs + 1) + stats.norm.ppf(LOWER) * std)
    else:
        beyond = int(np.count_nonzero(np.cumsum(_positive_sum_chances(np.arange(1, pairs + 1))) <= LOWER))
    last = len(means) - 1
    ranks = [last // 2, len(means) // 2, max(beyond - 1, 0), min(len(means) - beyond, last)]
    below, above, low, high = np.partition(means, ranks)[ranks].tolist()
    interval = Interval(low, high) if beyond else Interval(-math.inf, math.inf)
    return PairedResult(pairs, 0.5 * (below + above), interval, signed_rank_p(differences))


def signed_rank_p(differences: np.ndarray) -> float:
    """Compute the p-value of a symmetric distribution about zero; zero differences are ignored."""
    differences = differences[differences != 0.0]
    # Doubled, because mean ranks of ties may end in a half.
    ranks = np.rint(2.0 * stats.rankdata(np.abs(differences))).astype(int)
    signed_sum = abs(int(np.sum(np.sign(differences) * ranks)))
    if len(ranks) > MOST_PAIRS_EXACT:
        return float(2.0 * stats.norm.sf(signed_sum / math.sqrt(np.sum(np.square(ranks)))))
    chances = _positive_sum_chances(ranks)
    signed_sums = np.abs(2 * np.arange(len(chances)) - np.sum(ranks))
    return min(1.0, float(np.sum(chances[signed_sums >= signed_sum])))


def _positive_sum_chances(ranks: np.ndarray) -> np.ndarray:
    """Compute the probability of each sum, from zero, of ranks with random signs."""
    chances = np.zeros(int(np.sum(ranks)) + 1)
    chances[0] = 1.0
    for rank in ranks:
        chances *= 0.5
        chances[rank:] += chances[:-rank].copy()
    return chances


def mcnemar(first: np.ndarray, second: np.ndarray) -> PairedResult:
    """Estimate the difference of two paired fractions by McNemar's exact test; interval by Bonett and Price (2012)."""
    pairs = len(first)
    only_first, only_second = int(np.sum(first > second)), int(np.sum(second > first))
    if pairs == 0:
        return PairedResult(0, 0.0, Interval(-1.0, 1.0), 1.0)
    fractions = [(only + 1.0) / (pairs + 2.0) for only in (only_first, only_second)]
    middle = fractions[0] - fractions[1]
    margin = float(stats.norm.ppf(UPPER)) * math.sqrt((sum(fractions) - middle**2) / (pairs + 2.0))
    interval, changed = Interval(max(-1.0, middle - margin), min(1.0, middle + margin)), only_first + only_second
    p_value = float(stats.binomtest(only_first, changed).pvalue) if changed else 1.0
    return PairedResult(pairs, (only_first - only_second) / pairs, interval, p_value)


def holm(p_values: Sequence[float]) -> List[float]:
    """Adjust p-values by Holm's step-down method, in the given order."""
    order = np.argsort(p_values, kind='stable')
    stepped = np.asarray(p_values, dtype=float)[order] * np.arange(len(order), 0, -1)
    adjusted = np.empty(len(order))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return adjusted.tolist()
