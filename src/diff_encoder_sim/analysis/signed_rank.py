"""The distribution behind Wilcoxon's signed-rank test, for ties as well.

Under no difference, each rank is positive or negative by a fair coin. scipy's test is exact only
without ties, and odometry errors are whole pulses, so that ties are common.
"""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.deferred import deferred

stats = deferred('scipy.stats')

# Above, the normal distribution is near enough: at 100 pairs and p = 0.05 it differs by 0.0001.
MOST_PAIRS_EXACT = 100


def signed_rank_p(differences: np.ndarray) -> float:
    """Compute the two-sided p-value of differences that lie symmetrically about zero; those of zero are left out."""
    differences = differences[differences != 0.0]
    # Doubled, because the mean rank of an even number of ties ends in a half.
    ranks = np.rint(2.0 * stats.rankdata(np.abs(differences))).astype(int)
    signed_sum = abs(int(np.sum(np.sign(differences) * ranks)))
    if len(ranks) > MOST_PAIRS_EXACT:
        return float(2.0 * stats.norm.sf(signed_sum / math.sqrt(np.sum(np.square(ranks)))))
    chances = _positive_sum_chances(ranks)
    signed_sums = np.abs(2 * np.arange(len(chances)) - np.sum(ranks))
    return min(1.0, float(np.sum(chances[signed_sums >= signed_sum])))


def means_beyond_interval(pairs: int, level: float) -> int:
    """Count the means of two differences from either end to the interval's bound, it included.

    0 where not even the outermost ones are as unlikely as `level` asks.
    """
    tail = 0.5 - 0.5 * level
    if pairs > MOST_PAIRS_EXACT:
        std = math.sqrt(pairs * (pairs + 1) * (2 * pairs + 1) / 24.0)
        return int(0.25 * pairs * (pairs + 1) + stats.norm.ppf(tail) * std)
    chances = np.cumsum(_positive_sum_chances(np.arange(1, pairs + 1)))
    return int(np.count_nonzero(chances <= tail))


def _positive_sum_chances(ranks: np.ndarray) -> np.ndarray:
    """Compute the chance of each sum, from zero, of the ranks that a fair coin makes positive."""
    chances = np.zeros(int(np.sum(ranks)) + 1)
    chances[0] = 1.0
    for rank in ranks:
        chances *= 0.5
        chances[rank:] += chances[:-rank].copy()
    return chances
