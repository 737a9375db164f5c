"""Statistics of one sample: its spread, and intervals for fractions, means and spreads.

Spread is the standard deviation with n - 1. No result is NaN: where a sample is too small, intervals
are as wide as the quantity allows.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.base.deferred import deferred

stats = deferred('scipy.stats')

# Resamples of fewer values are too often without a spread themselves.
FEWEST_TO_RESAMPLE = 5

# A bound that is so many times the spread is as good as none.
WIDEST = 100.0

# Resamples are drawn in parts of so many values, which stay in a processor's cache.
DRAWN_AT_ONCE = 250_000

# Standard errors of the logarithm of a spread below this are rounding.
SMALLEST_ERROR = 1e-6


class Interval(NamedTuple):
    """Both bounds included."""

    low: float
    high: float


def spread(values: np.ndarray) -> Optional[float]:
    """Compute the standard deviation; None for fewer than two values, exactly 0 where all are equal."""
    if len(values) < 2:
        return None
    return float(np.std(values, ddof=1)) if np.ptp(values) > 0.0 else 0.0


def wilson(successes: int, n: int, level: float = LEVEL) -> Interval:
    """Compute Wilson's score interval of a fraction; (0, 1) without trials."""
    if n == 0:
        return Interval(0.0, 1.0)
    low, high = stats.binomtest(successes, n).proportion_ci(level, 'wilson')
    return Interval(float(low), float(high))


def mean_interval(values: np.ndarray, level: float = LEVEL) -> Interval:
    """Compute Student's t interval of the mean; unbounded for fewer than two values."""
    std = spread(values)
    if std is None:
        return Interval(-math.inf, math.inf)
    margin = float(stats.t.ppf(0.5 + 0.5 * level, len(values) - 1)) * std / math.sqrt(len(values))
    return Interval(float(np.mean(values)) - margin, float(np.mean(values)) + margin)


def std_interval(values: np.ndarray, level: float = LEVEL) -> Interval:
    """Compute the chi-square interval of the spread of normally distributed values.

    (0, infinity) for fewer than two values, (0, 0) where all are equal.
    """
    std, freedom = spread(values), len(values) - 1
    if std is None:
        return Interval(0.0, math.inf)
    low, high = stats.chi2.ppf(np.array([0.5 + 0.5 * level, 0.5 - 0.5 * level]), freedom)
    return Interval(std * math.sqrt(freedom / low), std * math.sqrt(freedom / high))


def bootstrap_std_interval(
    values: np.ndarray, level: float, rng: np.random.Generator, resamples: int = 2000
) -> Interval:
    """Compute an interval of the spread for values of any distribution: bootstrap-t of its logarithm.

    Efron and Tibshirani, An Introduction to the Bootstrap, section 12.5. With 30 normal values its
    95 % cover the truth in 93 %; percentile and BCa intervals do in 87 and 88 %.
    (0, infinity) for fewer than five values and for two values equally often, (0, 0) where all
    are equal. A bound that is WIDEST times the spread is none: one far-off value makes it so.
    """
    std = spread(values)
    if std is None or len(values) < FEWEST_TO_RESAMPLE:
        return Interval(0.0, math.inf)
    if std == 0.0:
        return Interval(0.0, 0.0)
    (log_std,), (error,) = _log_std(np.asarray(values)[np.newaxis])
    log_stds, errors = _resampled_log_std(values, resamples, rng)
    # Resamples of one value alone, or of two equally often, have no standard error.
    has_error = errors > SMALLEST_ERROR
    if error <= SMALLEST_ERROR or not has_error.any():
        return Interval(0.0, math.inf)
    deviations = (log_stds[has_error] - log_std) / errors[has_error]
    quantiles = np.quantile(deviations, [0.5 + 0.5 * level, 0.5 - 0.5 * level])
    with np.errstate(over='ignore'):
        low, high = np.exp(log_std - quantiles * error).tolist()
    return Interval(low, high if high < WIDEST * std else math.inf)


def _resampled_log_std(values: np.ndarray, resamples: int, rng: np.random.Generator) -> Tuple[np.ndarray, np.ndarray]:
    """Compute `_log_std` of so many resamples; the draws do not depend on how many there are at once."""
    most = max(1, DRAWN_AT_ONCE // len(values))
    counts = [min(most, resamples - first) for first in range(0, resamples, most)]
    log_stds, errors = zip(*(_log_std(rng.choice(values, (count, len(values)))) for count in counts))
    return np.concatenate(log_stds), np.concatenate(errors)


def _log_std(samples: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Compute the logarithm of each row's spread and its standard error, from the fourth moment; 0 without a spread."""
    squares = np.square(samples - np.mean(samples, axis=1, keepdims=True))
    variances = np.mean(squares, axis=1)
    has_spread = np.ptp(samples, axis=1) > 0.0
    variances[~has_spread] = 1.0
    n = samples.shape[1]
    excess = np.mean(np.square(squares), axis=1) / np.square(variances) - 1.0
    errors = np.sqrt(np.maximum(excess, 0.0) / (4.0 * n))
    return 0.5 * np.log(variances * n / (n - 1)), np.where(has_spread, errors, 0.0)
