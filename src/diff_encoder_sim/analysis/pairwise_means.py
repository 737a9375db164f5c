"""Means of any two of some values by their rank, without making them all: of 10,000 values they are 50 million."""

from __future__ import annotations

import numpy as np

# So many are made and sorted at once.
MOST_AT_ONCE = 100_000


def mean_of_rank(ascending: np.ndarray, rank: int) -> float:
    """Return the mean of that rank among those of any two values, each with itself among them.

    In the order of their values, the means of each with itself and those after it are a row, which ascends. What the
    rank rules out is cut off the rows' ends, about half of it each time (Johnson and Mizoguchi 1978).

    Args:
        ascending: (n,) the values, sorted, n > 0.
        rank: from 0 for the least to n (n + 1) / 2 - 1.
    """
    first = np.arange(len(ascending))
    low, high = first, np.full(len(ascending), len(ascending))
    while np.sum(high - low) > MOST_AT_ONCE:
        middle = _middle(ascending, low, high)
        below = _columns_until(ascending, low, high, middle, is_below=True)
        if rank < np.sum(below - first):
            high = below
            continue
        low = _columns_until(ascending, below, high, middle, is_below=False)
        if rank < np.sum(low - first):
            return middle
    left = _means(ascending, low, high)
    rank -= int(np.sum(low - first))
    return float(np.partition(left, rank)[rank])


def _middle(ascending: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Return the median of the rows' medians, each counted as often as its row is long."""
    lengths = high - low
    rows = np.flatnonzero(lengths)
    medians = 0.5 * (ascending[rows] + ascending[(low + lengths // 2)[rows]])
    order = np.argsort(medians)
    counted = np.cumsum(lengths[rows][order])
    return float(medians[order][np.searchsorted(counted, 0.5 * counted[-1])])


def _columns_until(
    ascending: np.ndarray, low: np.ndarray, high: np.ndarray, value: float, is_below: bool
) -> np.ndarray:
    """(n,) columns between `low` and `high` where each row's means are no longer below a value, or exceed it."""
    precedes = np.less if is_below else np.less_equal

    def is_before(column: np.ndarray) -> np.ndarray:
        mean = 0.5 * (ascending + ascending[np.minimum(column, len(ascending) - 1)])
        return np.asarray(precedes(mean, value))

    # Right but for rounding.
    guess = np.searchsorted(ascending, 2.0 * value - ascending, 'left' if is_below else 'right')
    guess = np.minimum(np.maximum(guess, low), high)
    low, high = np.where(is_before(guess - 1), guess, low), np.where(is_before(guess), high, guess)
    while (low < high).any():
        column = (low + high) // 2
        goes_on = is_before(column) & (low < high)
        low, high = np.where(goes_on, column + 1, low), np.where(goes_on, high, column)
    return low


def _means(ascending: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    lengths = high - low
    rows = np.repeat(np.arange(len(ascending)), lengths)
    columns = np.arange(len(rows)) + np.repeat(low - np.cumsum(lengths) + lengths, lengths)
    means: np.ndarray = 0.5 * (ascending[rows] + ascending[columns])
    return means
