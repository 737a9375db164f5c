"""Compares each number of the paper with ours: can the difference be chance? And how many numbers agree."""

from __future__ import annotations

import functools
import math
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, Varied
from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.final_errors import count_within, final_errors
from diff_encoder_sim.analysis.paper.paper_cells import (
    TRIALS,
    ComparedResolution,
    PaperCell,
    compare_resolutions,
    errata_of,
    load_paper_cells,
)
from diff_encoder_sim.analysis.quantities import LEVEL, Quantity
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, Interval, holm, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.drives.topics import PoseSource

optimize = deferred('scipy.optimize')
stats = deferred('scipy.stats')

# Values that differ by less are equal but for rounding.
ROUNDING = 1e-9

# The excess of the kurtosis has an unbiased estimate from so many values on.
FEWEST_FOR_KURTOSIS = 4

# How far the largest values reach is judged by the largest of ours.
TAIL_FRACTION = 0.25


def spread_p_value(values: np.ndarray, reported: float, count: int) -> float:
    """Test a reported standard deviation of `count` values by the F-test, careful where our tails are heavy.

    Box (Biometrika 40, 1953): with the excess kurtosis g the logarithm of a variance is 1 + g / 2 times as
    uncertain as a Gaussian's, so that both degrees of freedom are divided by it. Light tails are taken as
    Gaussian. Of at least two values.
    """
    ours, freedom = spread(values) or 0.0, np.array([len(values) - 1, count - 1])
    if ours == reported:
        return 1.0
    if min(ours, reported) == 0.0:
        return 0.0
    ratio = (ours / reported) ** 2
    degrees = freedom / (1.0 + 0.5 * _excess_kurtosis(values))
    return min(1.0, 2.0 * float(min(stats.f.cdf(ratio, *degrees), stats.f.sf(ratio, *degrees))))


def maximum_p_value(values: np.ndarray, reported: Interval, count: int) -> Optional[float]:
    """Test a reported maximum of `count` values, on both sides; None where nothing can be concluded.

    How many of ours lie above it has a known chance, whatever the distribution (`_chances_of_above`). Beyond all
    of ours, that chance says no more: there the tail is taken as exponential (`_chance_beyond`), which Gaussian
    and uniform tails do not reach, so that for them false alarms are rarer.

    Args:
        values: ours; at least one.
        reported: the numbers that round to the reported one; the nearest counts.
        count: of the values behind it.
    """
    fewest, most = (int(np.count_nonzero(values > bound)) for bound in (reported.high, reported.low))
    chances = _chances_of_above(len(values), count)
    too_low = float(chances[fewest])
    if most:
        too_high = 1.0 - float(chances[most + 1])
    else:
        scale = _tail_scale(values)
        if scale is None:
            return None
        beyond = max(0.0, (reported.low - float(values.max())) / scale)
        too_high = _chance_beyond(beyond, len(values), count)
    return min(1.0, 2.0 * min(too_low, too_high))


def maximum_interval(values: np.ndarray, count: int, level: float) -> Interval:
    """Compute where the maximum of `count` fresh values lies: all that `maximum_p_value` does not reject.

    An infinite bound is none: there are too few values for it, or they are all equal.
    """
    descending, tail = np.sort(values)[::-1], 0.5 - 0.5 * level
    chances = _chances_of_above(len(values), count)
    likely = int(np.count_nonzero(chances[:-1] >= tail))
    low = float(descending[likely - 1]) if likely <= len(values) else -math.inf
    unlikely = int(np.count_nonzero(1.0 - chances[1 : likely + 1] < tail))
    if unlikely:
        return Interval(low, float(descending[unlikely - 1]))
    scale = _tail_scale(values)
    if scale is None:
        return Interval(low, math.inf)
    return Interval(low, float(descending[0]) + scale * _furthest(len(values), count, tail))


@functools.lru_cache(maxsize=8)
def _chances_of_above(ours: int, theirs: int) -> np.ndarray:
    """(ours + 2,) chances that at least 0, 1, 2, ... of ours exceed the maximum of theirs, all orders equally likely.

    From 1 for none, to 0 for one more than there are.
    """
    ranks = np.arange(ours + 1)
    chances = np.cumprod(np.concatenate([[1.0], (ours - ranks) / (ours + theirs - ranks)]))
    chances.setflags(write=False)  # all callers have the same
    return chances


def _tail_scale(values: np.ndarray) -> Optional[float]:
    """Estimate by how much the values of the tail exceed the next one in the mean; None where they are all equal.

    Whole pulses make values that are multiples of a step: no tail falls off within less than that.
    """
    descending, tail = np.sort(values)[::-1], _in_tail(len(values))
    if tail == 0 or descending[0] - descending[tail] < ROUNDING:
        return None
    steps = -np.diff(descending)
    return float(max(np.mean(descending[:tail]) - descending[tail], np.min(steps[steps > ROUNDING])))


def _in_tail(count: int) -> int:
    """Return how many of the largest of our values are the tail: a quarter of them."""
    return min(math.ceil(TAIL_FRACTION * count), count - 1)


@functools.lru_cache(maxsize=4096)
def _chance_beyond(beyond: float, ours: int, theirs: int) -> float:
    """Return the chance that the maximum of theirs exceeds ours by `beyond` estimated scales of the tail.

    Of an exponential tail, the i-th spacing from the top is exponential with mean 1/i (Renyi), all are independent,
    and the scale is the mean of i times the first `tail` of them. So the mean of exp(-j M), M the place of our
    maximum plus `beyond` scales, is a product; the binomial sum over j is the chance that theirs lie below M.
    """
    ranks, tail, total = np.arange(1, ours + 1), _in_tail(ours), 0.0
    in_tail = np.where(ranks <= tail, beyond / tail, 0.0)
    for j in range(1, theirs + 1):
        means = 1.0 / (1.0 + j / ranks + j * in_tail)
        total -= math.comb(theirs, j) * (-1.0) ** j * float(np.prod(means))
    return total


@functools.lru_cache(maxsize=256)
def _furthest(ours: int, theirs: int, chance: float) -> float:
    """Return how many scales beyond ours the maximum of theirs lies with this chance."""
    high = 1.0
    while _chance_beyond(high, ours, theirs) > chance:
        high *= 2.0
    return float(optimize.brentq(lambda beyond: _chance_beyond(beyond, ours, theirs) - chance, 0.0, high))


def _excess_kurtosis(values: np.ndarray) -> float:
    if len(values) < FEWEST_FOR_KURTOSIS or not spread(values):
        return 0.0
    return max(0.0, float(stats.kurtosis(values, bias=False)))


# Half of the last digit that the paper prints, of metres and of degrees alike.
HALF_A_DIGIT = 0.0005


class Agreement(NamedTuple):
    """One statistic of ours, and how it agrees with the paper's."""

    ours: float
    interval: Interval  # 95 %: of the statistic; of min and max, where those of the paper's number of trials lie
    p_value: Optional[float]  # two-sided; None where nothing can be concluded


def compare_std(values: np.ndarray, paper_std: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by the F-test, careful where our tails are heavy; None for fewer than two values."""
    ours = spread(values)
    if ours is None:
        return None
    # A printed number stands for all numbers that round to it: the nearest counts.
    theirs = float(np.clip(ours, max(0.0, paper_std - HALF_A_DIGIT), paper_std + HALF_A_DIGIT))
    interval = std_interval(values, LEVEL)
    return Agreement(ours, interval, spread_p_value(values, theirs, TRIALS))


def compare_pct_within(values: np.ndarray, paper_pct: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare by Fisher's exact test; None without a value."""
    if len(values) == 0:
        return None
    ours, theirs = count_within(values, quantity), round(paper_pct / 100.0 * TRIALS)
    interval = Interval(*(100.0 * bound for bound in wilson(ours, len(values), LEVEL)))
    _, p_value = stats.fisher_exact(np.array([[ours, len(values) - ours], [theirs, TRIALS - theirs]]))
    return Agreement(100.0 * ours / len(values), interval, float(p_value))


def compare_max(values: np.ndarray, paper_max: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare with where the largest of as many trials as the paper's would lie; None without a value."""
    if len(values) == 0:
        return None
    printed = Interval(paper_max - HALF_A_DIGIT, paper_max + HALF_A_DIGIT)
    interval = maximum_interval(values, TRIALS, LEVEL)
    return Agreement(float(values.max()), interval, maximum_p_value(values, printed, TRIALS))


def compare_min(values: np.ndarray, paper_min: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare as `compare_max` does, with the signs reversed."""
    reversed_ = compare_max(-values, -paper_min, quantity)
    if reversed_ is None:
        return None
    low, high = reversed_.interval
    return reversed_._replace(ours=-reversed_.ours, interval=Interval(-high, -low))


COMPARISONS: Dict[str, Callable[[np.ndarray, float, Quantity], Optional[Agreement]]] = {
    'min': compare_min,
    'max': compare_max,
    'std': compare_std,
    'pct_within': compare_pct_within,
}


# The only cells that parameters were fitted to: table, test, PPR and quantity
# (docs/adr/0012-calibration.md).
CALIBRATED = (4, 'SL', '4096', 'y_m')


class ComparedCell(NamedTuple):
    """A number of the paper and ours."""

    paper: PaperCell
    cell: CellKey  # ours; there are several of one test and PPR where parameters are varied
    trials: int  # ours
    agreement: Agreement
    errata: List[str]  # keys of errata.ERRATA
    p_adjusted: Optional[float]  # by Holm, over the cells of its family that are evidence; None where it is none

    @property
    def is_calibrated(self) -> bool:
        """Return whether config/campaigns/paper.yaml was fitted to it, so that it is no prediction."""
        paper = self.paper
        return (paper.table, paper.test, paper.ppr, paper.quantity.name) == CALIBRATED

    @property
    def is_evidence(self) -> bool:
        """Return whether it speaks for or against: a sound number of the paper, not fitted to, that can be tested."""
        return not self.errata and not self.is_calibrated and self.agreement.p_value is not None

    @property
    def is_contradicted(self) -> bool:
        """Return whether chance does not explain the difference, corrected for the number of cells in its family."""
        return self.p_adjusted is not None and self.p_adjusted < SIGNIFICANCE

    @property
    def family(self) -> Tuple[PoseSource, str, Varied]:
        """Return what the cells that are judged together have in common."""
        return self.paper.source, self.paper.test, self.cell.varied


class PaperComparison(NamedTuple):
    """All numbers that the paper and the dataset both have."""

    rows: List[ComparedCell]
    resolutions: List[ComparedResolution]  # table 3 for this robot, PPR ascending


def compare_with_paper(dataset: Dataset) -> PaperComparison:
    """Compare each number of the paper with ours, where the dataset has its test and PPR.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    resolutions = compare_resolutions(ppr_values(dataset.encoders()), *dataset.robot)
    return PaperComparison(_judged(list(_compared_cells(dataset, load_paper_cells()))), resolutions)


def _judged(cells: List[ComparedCell]) -> List[ComparedCell]:
    """Correct the p-values in each family for the number of its cells."""
    families: Dict[Tuple[PoseSource, str, Varied], List[int]] = {}
    for index, one in enumerate(cells):
        if one.is_evidence:
            families.setdefault(one.family, []).append(index)
    for indices in families.values():
        adjusted = holm([p_value for index in indices if (p_value := cells[index].agreement.p_value) is not None])
        for index, p_value in zip(indices, adjusted):
            cells[index] = cells[index]._replace(p_adjusted=p_value)
    return cells


def _compared_cells(dataset: Dataset, printed: List[PaperCell]) -> Iterator[ComparedCell]:
    for cell, trials in dataset.cells().items():
        for paper in printed:
            if (paper.test, paper.ppr) == (cell.test, cell.ppr):
                values = final_errors(trials, paper.source, paper.quantity)
                agreement = COMPARISONS[paper.statistic](values, paper.value, paper.quantity)
                if agreement is not None:
                    yield ComparedCell(paper, cell, len(values), agreement, errata_of(paper), None)


# Compared cells of a campaign, or of one set of its varied parameters, by the name that tells them apart.
Readings = Dict[str, List[ComparedCell]]


class Score(NamedTuple):
    """How many cells agree, of those that are evidence."""

    compared: int
    agree: int  # not contradicted


def score(cells: Sequence[ComparedCell]) -> Score:
    """Count the cells that agree."""
    evidence = [one for one in cells if one.is_evidence]
    return Score(len(evidence), sum(not one.is_contradicted for one in evidence))
