"""Compares one statistic of ours with the paper's: can the difference be chance?

The paper has 30 trials per cell, so that its numbers have a sampling error as ours have: the
p-value is that of equal distributions behind both samples.
"""

from __future__ import annotations

import math
from typing import Callable, Dict, NamedTuple, Optional

import numpy as np
from scipy import stats

from diff_encoder_sim.analysis.final_errors import count_within
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, Interval, spread, std_interval, wilson

# Half of the last digit that the paper prints, of metres and of degrees alike.
HALF_A_DIGIT = 0.0005


class Agreement(NamedTuple):
    """One statistic of ours, and how it agrees with the paper's."""

    ours: float
    interval: Optional[Interval]  # 95 %; None for min and max, which have none without a model
    p_value: Optional[float]  # two-sided; None where nothing can be concluded


def compare_std(values: np.ndarray, paper_std: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by the F-test, which assumes Gaussian errors; None for fewer than two values."""
    ours = spread(values)
    if ours is None:
        return None
    # A printed number stands for all numbers that round to it: the nearest counts.
    theirs = float(np.clip(ours, max(0.0, paper_std - HALF_A_DIGIT), paper_std + HALF_A_DIGIT))
    interval = std_interval(values, LEVEL)
    if ours == theirs:
        return Agreement(ours, interval, 1.0)
    if min(ours, theirs) == 0.0:
        return Agreement(ours, interval, 0.0)
    ratio_and_freedom = (ours / theirs) ** 2, len(values) - 1, TRIALS - 1
    return Agreement(ours, interval, 2.0 * float(min(stats.f.cdf(*ratio_and_freedom), stats.f.sf(*ratio_and_freedom))))


def compare_pct_within(values: np.ndarray, paper_pct: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by Fisher's exact test; None without a value."""
    if len(values) == 0:
        return None
    ours, theirs = count_within(values, quantity), round(paper_pct / 100.0 * TRIALS)
    interval = Interval(*(100.0 * bound for bound in wilson(ours, len(values), LEVEL)))
    _, p_value = stats.fisher_exact(np.array([[ours, len(values) - ours], [theirs, TRIALS - theirs]]))
    return Agreement(100.0 * ours / len(values), interval, float(p_value))


def compare_max(values: np.ndarray, paper_max: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by how many of ours exceed the paper's maximum; None without a value.

    If both samples had one distribution, every order of their values would be equally likely.
    Where none of ours exceeds it, nothing can be concluded: the paper's second largest is unknown.
    """
    if len(values) == 0:
        return None
    beyond = int(np.count_nonzero(values > paper_max + HALF_A_DIGIT))
    if beyond == 0:
        return Agreement(float(values.max()), None, None)
    both = len(values) + TRIALS
    chance = math.prod((len(values) - rank) / (both - rank) for rank in range(beyond))
    return Agreement(float(values.max()), None, min(1.0, 2.0 * chance))


def compare_min(values: np.ndarray, paper_min: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare as `compare_max` does, with the signs reversed."""
    reversed_ = compare_max(-values, -paper_min, quantity)
    return reversed_ and reversed_._replace(ours=-reversed_.ours)


COMPARISONS: Dict[str, Callable[[np.ndarray, float, Quantity], Optional[Agreement]]] = {
    'min': compare_min,
    'max': compare_max,
    'std': compare_std,
    'pct_within': compare_pct_within,
}
