"""Compares one statistic of ours with the paper's: can the difference be chance?

The paper has 30 trials per cell, so that its numbers have a sampling error as ours have: the
p-value is that of equal distributions behind both samples.
"""

from __future__ import annotations

from typing import Callable, Dict, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.final_errors import count_within
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.reported_statistics import maximum_interval, maximum_p_value, spread_p_value
from diff_encoder_sim.analysis.sample_statistics import Interval, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred

stats = deferred('scipy.stats')

# Half of the last digit that the paper prints: of metres and of degrees alike, and of per cent.
HALF_A_DIGIT = 0.0005
HALF_A_PERCENT_DIGIT = 0.05


class Agreement(NamedTuple):
    """One statistic of ours, and how it agrees with the paper's."""

    ours: float
    interval: Interval  # 95 %: of the statistic; of min and max, where those of the paper's number of trials lie
    is_inside: bool  # the paper's number is in the interval, as far as it is printed
    p_value: Optional[float]  # two-sided; None where nothing can be concluded


def compare_std(values: np.ndarray, paper_std: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by the F-test, careful where our tails are heavy; None for fewer than two values."""
    ours = spread(values)
    if ours is None:
        return None
    # A printed number stands for all numbers that round to it: the nearest counts.
    theirs = float(np.clip(ours, max(0.0, paper_std - HALF_A_DIGIT), paper_std + HALF_A_DIGIT))
    interval = std_interval(values, LEVEL)
    p_value = spread_p_value(values, theirs, TRIALS)
    return Agreement(ours, interval, _is_inside(paper_std, interval, HALF_A_DIGIT), p_value)


def compare_pct_within(values: np.ndarray, paper_pct: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by Fisher's exact test; None without a value."""
    if len(values) == 0:
        return None
    ours, theirs = count_within(values, quantity), round(paper_pct / 100.0 * TRIALS)
    interval = Interval(*(100.0 * bound for bound in wilson(ours, len(values), LEVEL)))
    _, p_value = stats.fisher_exact(np.array([[ours, len(values) - ours], [theirs, TRIALS - theirs]]))
    is_inside = _is_inside(paper_pct, interval, HALF_A_PERCENT_DIGIT)
    return Agreement(100.0 * ours / len(values), interval, is_inside, float(p_value))


def compare_max(values: np.ndarray, paper_max: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare with where the largest of as many trials as the paper's would lie; None without a value."""
    if len(values) == 0:
        return None
    printed = Interval(paper_max - HALF_A_DIGIT, paper_max + HALF_A_DIGIT)
    interval = maximum_interval(values, TRIALS, LEVEL)
    p_value = maximum_p_value(values, printed, TRIALS)
    return Agreement(float(values.max()), interval, _is_inside(paper_max, interval, HALF_A_DIGIT), p_value)


def compare_min(values: np.ndarray, paper_min: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare as `compare_max` does, with the signs reversed."""
    reversed_ = compare_max(-values, -paper_min, quantity)
    if reversed_ is None:
        return None
    low, high = reversed_.interval
    return reversed_._replace(ours=-reversed_.ours, interval=Interval(-high, -low))


def _is_inside(printed: float, interval: Interval, half_a_digit: float) -> bool:
    return interval.low - half_a_digit <= printed <= interval.high + half_a_digit


COMPARISONS: Dict[str, Callable[[np.ndarray, float, Quantity], Optional[Agreement]]] = {
    'min': compare_min,
    'max': compare_max,
    'std': compare_std,
    'pct_within': compare_pct_within,
}
