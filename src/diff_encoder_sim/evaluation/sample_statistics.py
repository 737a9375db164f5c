"""What a sample tells: intervals for shares and spreads, and equal trials compared in pairs.

Spread is the standard deviation with n - 1. No result is NaN: where a sample is too small to tell,
intervals are as wide as the quantity allows and p-values are 1. All p-values are two-sided.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from scipy import stats

from diff_encoder_sim.evaluation.signed_rank import means_beyond_interval, signed_rank_p

LEVEL = 0.95  # of all intervals that are shown
SIGNIFICANCE = 0.05  # p-values below it tell a difference

# Resamples of fewer values are too often without a spread themselves.
FEWEST_TO_RESAMPLE = 5

# Sums of squares that cancel to less than this share of what they came from are rounding.
ROUNDING = 1e-12

# Above it a bound of a spread, relative to the spread, says nothing.
WIDEST = 100.0

# Of the logarithm of a spread; what is below is rounding.
SMALLEST_ERROR = 1e-6


class Interval(NamedTuple):
    """Both bounds included."""

    low: float
    high: float


class PairedResult(NamedTuple):
    """How the first of two samples of equal trials differs from the second."""

    pairs: int
    estimate: float
    interval: Interval  # for this comparison alone
    p_value: float  # that of no difference; likewise


def spread(values: np.ndarray) -> Optional[float]:
    """Standard deviation; None for fewer than two values, exactly 0 where all are equal."""
    if len(values) < 2:
        return None
    return float(np.std(values, ddof=1)) if np.ptp(values) > 0.0 else 0.0


def wilson(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Wilson's score interval of a share; (0, 1) without trials."""
    if n == 0:
        return Interval(0.0, 1.0)
    low, high = stats.binomtest(successes, n).proportion_ci(level, 'wilson')
    return Interval(float(low), float(high))


def mean_interval(values: np.ndarray, level: float = LEVEL) -> Interval:
    """Student's t interval of the mean; unbounded for fewer than two values."""
    std = spread(values)
    if std is None:
        return Interval(-math.inf, math.inf)
    margin = float(stats.t.ppf(0.5 + 0.5 * level, len(values) - 1)) * std / math.sqrt(len(values))
    return Interval(float(np.mean(values)) - margin, float(np.mean(values)) + margin)


def std_interval(values: np.ndarray, level: float = LEVEL) -> Interval:
    """Chi-square interval of the spread of normally distributed values.

    (0, infinity) for fewer than two values, (0, 0) where all are equal.
    """
    std, freedom = spread(values), len(values) - 1
    if std is None:
        return Interval(0.0, math.inf)
    low, high = stats.chi2.ppf([0.5 + 0.5 * level, 0.5 - 0.5 * level], freedom)
    return Interval(std * math.sqrt(freedom / low), std * math.sqrt(freedom / high))


def bootstrap_std_interval(
    values: np.ndarray, level: float, rng: np.random.Generator, resamples: int = 2000
) -> Interval:
    """Interval of the spread of values of any distribution: bootstrap-t of its logarithm.

    Efron and Tibshirani, An Introduction to the Bootstrap, section 12.5. With 30 normal values its
    95 % cover the truth in 93 %; percentile and BCa intervals do in 87 and 88 %.
    (0, infinity) for fewer than five values and for two values equally often, (0, 0) where all
    are equal. A bound that is WIDEST times the spread is none: one far-off value makes it so.
    """
    if len(values) < FEWEST_TO_RESAMPLE:
        return Interval(0.0, math.inf)
    if spread(values) == 0.0:
        return Interval(0.0, 0.0)
    (log_std,), (error,) = _log_std(np.asarray(values)[np.newaxis])
    log_stds, errors = _log_std(rng.choice(values, (resamples, len(values))))
    # Resamples of one value alone, or of two equally often, have no standard error.
    told = errors > SMALLEST_ERROR
    if error <= SMALLEST_ERROR or not told.any():
        return Interval(0.0, math.inf)
    deviations = (log_stds[told] - log_std) / errors[told]
    quantiles = np.quantile(deviations, [0.5 + 0.5 * level, 0.5 - 0.5 * level])
    with np.errstate(over='ignore'):
        low, high = np.exp(log_std - quantiles * error).tolist()
    return Interval(low, high if high < WIDEST * spread(values) else math.inf)


def spread_ratio(first: np.ndarray, second: np.ndarray, level: float = LEVEL) -> PairedResult:
    """Spread of the first over that of the second, for pairs of any distribution.

    The interval is the jackknife's of the ratio's logarithm (Miller 1968). The p-value is its own
    or that of the squared deviations' signed ranks, whichever is larger: where many comparisons ask
    for tiny p-values, far-off values make the jackknife's too small, and skewed ones the ranks'.
    Where a sample is without a spread, or owes it to one value, the interval is (0, infinity) and
    only the ranks count; the ratio of two samples without a spread is 1.
    """
    pairs, ratio = len(first), _ratio(spread(first), spread(second))
    if pairs < 3:
        return PairedResult(pairs, ratio, Interval(0.0, math.inf), 1.0)
    squares = [np.square(values - np.mean(values)) if spread(values) else np.zeros(pairs) for values in (first, second)]
    # Without one pair, the sums of squares about the mean that is then left.
    without = [np.sum(square) - square * pairs / (pairs - 1) for square in squares]
    rank_p_value = signed_rank_p(squares[0] - squares[1])
    if any((left <= ROUNDING * np.sum(square)).any() for left, square in zip(without, squares)):
        return PairedResult(pairs, ratio, Interval(0.0, math.inf), rank_p_value)
    pseudo_values = pairs * math.log(ratio) - (pairs - 1) * 0.5 * np.log(without[0] / without[1])
    low, high = mean_interval(pseudo_values, level)
    return PairedResult(
        pairs, ratio, Interval(math.exp(low), math.exp(high)), max(_t_test_p(pseudo_values), rank_p_value)
    )


def wilcoxon(first: np.ndarray, second: np.ndarray, level: float = LEVEL) -> PairedResult:
    """How far the first lies above the second: the signed-rank test, with ties too.

    The estimate is Hodges and Lehmann's (the median of the means of any two differences), the
    interval the one that belongs to the test. Pairs without a difference count in both, but not in
    the p-value.
    """
    differences = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    pairs = len(differences)
    if pairs == 0:
        return PairedResult(0, 0.0, Interval(-math.inf, math.inf), 1.0)
    rows, columns = np.triu_indices(pairs)
    means = np.sort(0.5 * (differences[rows] + differences[columns]))
    beyond = means_beyond_interval(pairs, level)
    interval = (
        Interval(-math.inf, math.inf) if beyond == 0 else Interval(float(means[beyond - 1]), float(means[-beyond]))
    )
    return PairedResult(pairs, float(np.median(means)), interval, signed_rank_p(differences))


def mcnemar(first: np.ndarray, second: np.ndarray, level: float = LEVEL) -> PairedResult:
    """How much more often the first is true than the second: share minus share.

    McNemar's exact test; the interval is Bonett and Price's of 2012.
    """
    pairs = len(first)
    only_first = int(np.count_nonzero(np.logical_and(first, np.logical_not(second))))
    only_second = int(np.count_nonzero(np.logical_and(second, np.logical_not(first))))
    if pairs == 0:
        return PairedResult(0, 0.0, Interval(-1.0, 1.0), 1.0)
    shares = [(only + 1.0) / (pairs + 2.0) for only in (only_first, only_second)]
    middle = shares[0] - shares[1]
    margin = float(stats.norm.ppf(0.5 + 0.5 * level)) * math.sqrt((sum(shares) - middle**2) / (pairs + 2.0))
    changed = only_first + only_second
    return PairedResult(
        pairs,
        (only_first - only_second) / pairs,
        Interval(max(-1.0, middle - margin), min(1.0, middle + margin)),
        float(stats.binomtest(only_first, changed).pvalue) if changed else 1.0,
    )


def holm(p_values: Sequence[float]) -> List[float]:
    """Holm's step-down p-values, in the order given.

    Of those below 0.05 not one is false in 95 of 100 analyses.
    """
    order = np.argsort(p_values, kind='stable')
    stepped = np.asarray(p_values, dtype=float)[order] * np.arange(len(order), 0, -1)
    adjusted = np.empty(len(order))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return adjusted.tolist()


def _log_std(samples: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Of each row the logarithm of its spread, and that one's standard error; 0 where it has none.

    The error follows from the fourth moment.
    """
    squares = np.square(samples - np.mean(samples, axis=1, keepdims=True))
    variances = np.mean(squares, axis=1)
    has_spread = np.ptp(samples, axis=1) > 0.0
    variances[~has_spread] = 1.0
    n = samples.shape[1]
    excess = np.mean(np.square(squares), axis=1) / np.square(variances) - 1.0
    errors = np.sqrt(np.maximum(excess, 0.0) / (4.0 * n))
    return 0.5 * np.log(variances * n / (n - 1)), np.where(has_spread, errors, 0.0)


def _ratio(first: Optional[float], second: Optional[float]) -> float:
    if first == second or first is None or second is None:
        return 1.0
    return first / second if second > 0.0 else math.inf


def _t_test_p(values: np.ndarray) -> float:
    """Of a mean of zero."""
    mean, error = float(np.mean(values)), spread(values) / math.sqrt(len(values))
    if mean == 0.0:
        return 1.0
    return float(2.0 * stats.t.sf(abs(mean) / error, len(values) - 1)) if error > 0.0 else 0.0
