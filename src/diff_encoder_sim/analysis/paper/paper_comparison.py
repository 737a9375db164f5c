"""The paper's tables 4 to 6 beside our own numbers, and whether the difference can be chance.

The paper has 30 trials a cell, so that its numbers have a sampling error as ours have: for each
cell the p-value is that of equal distributions behind both samples. It prints no mean.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Callable, Dict, List, NamedTuple, Optional, Tuple

import numpy as np
from scipy import stats

from diff_encoder_sim.analysis.dataset import Cell, Dataset, ppr_value
from diff_encoder_sim.analysis.final_errors import count_within, final_errors
from diff_encoder_sim.analysis.paper.errata import errata_of
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS, PaperCell, load_paper_cells
from diff_encoder_sim.analysis.paper.printed_resolutions import ComparedResolution, compare_resolutions
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, SIGNIFICANCE, Interval, spread, std_interval, wilson
from diff_encoder_sim.trials.pose_source import PoseSource

# The only cells that parameters were fitted to: table, test, PPR and quantity
# (docs/adr/0012-calibration.md).
CALIBRATED = (4, 'SL', '4096', 'y_m')

# Half of the last digit that the paper prints, of metres and of degrees alike.
HALF_A_DIGIT = 0.0005


class Agreement(NamedTuple):
    """One statistic of ours, and how it goes with the paper's."""

    ours: float
    interval: Optional[Interval]  # 95 %; None for min and max, which have none without a model
    p_value: Optional[float]  # two-sided; None where nothing can be said


class ComparedCell(NamedTuple):
    """A number of the paper and ours."""

    paper: PaperCell
    cell: Cell  # ours; `varied` tells those of one test and PPR apart
    trials: int  # ours
    agreement: Agreement
    errata: List[str]  # keys of paper_errata.ERRATA

    @property
    def is_compatible(self) -> Optional[bool]:
        """Whether chance alone explains the difference; None where that cannot be told."""
        p_value = self.agreement.p_value
        return None if p_value is None else p_value >= SIGNIFICANCE

    @property
    def is_calibrated(self) -> bool:
        """Whether config/campaigns/paper.yaml was fitted to it: no prediction then."""
        paper = self.paper
        return (paper.table, paper.test, paper.ppr, paper.quantity.name) == CALIBRATED


class Score(NamedTuple):
    """How many cells of a kind agree; chance alone makes about one in twenty differ."""

    tested: int
    compatible: int


class PaperComparison(NamedTuple):
    """All that both have."""

    rows: List[ComparedCell]
    resolutions: List[ComparedResolution]  # table 3 for this robot, PPR ascending

    def scores(self) -> Dict[Tuple[PoseSource, str], Score]:
        """By source and PPR, of predictions; cells that the paper's errata affect are left out."""
        sound = [row for row in self.rows if row.is_compatible is not None and not row.errata and not row.is_calibrated]
        tested = Counter((row.paper.source, row.paper.ppr) for row in sound)
        compatible = Counter((row.paper.source, row.paper.ppr) for row in sound if row.is_compatible)
        return {key: Score(count, compatible[key]) for key, count in tested.items()}


def compare_with_paper(dataset: Dataset) -> PaperComparison:
    """Our number for each of the paper's, where the dataset has that test and PPR.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    printed = load_paper_cells()
    rows = []
    for cell, trials in dataset.cells().items():
        for paper in printed:
            if (paper.test, paper.ppr) != (cell.test, cell.ppr):
                continue
            values = final_errors(trials, paper.source, paper.quantity)
            agreement = _COMPARISONS[paper.statistic](values, paper.value, paper.quantity)
            if agreement is not None:
                rows.append(
                    ComparedCell(
                        paper,
                        cell,
                        len(values),
                        agreement,
                        errata_of(paper.table, paper.test, paper.ppr, paper.quantity.name, paper.statistic),
                    )
                )
    pprs = {ppr_value(trial.ppr) for trial in dataset.trials} - {None}
    return PaperComparison(rows, compare_resolutions(sorted(pprs), *dataset.robot))


def compare_std(values: np.ndarray, paper_std: float, quantity: Quantity) -> Optional[Agreement]:
    """By the F-test, which takes errors for Gaussian; None for fewer than two values."""
    ours = spread(values)
    if ours is None:
        return None
    # What was printed stands for all numbers that round to it: the nearest counts.
    theirs = float(np.clip(ours, max(0.0, paper_std - HALF_A_DIGIT), paper_std + HALF_A_DIGIT))
    interval = std_interval(values, LEVEL)
    if ours == theirs:
        return Agreement(ours, interval, 1.0)
    if min(ours, theirs) == 0.0:
        return Agreement(ours, interval, 0.0)
    ratio_and_freedom = (ours / theirs) ** 2, len(values) - 1, TRIALS - 1
    return Agreement(ours, interval, 2.0 * float(min(stats.f.cdf(*ratio_and_freedom), stats.f.sf(*ratio_and_freedom))))


def compare_pct_within(values: np.ndarray, paper_pct: float, quantity: Quantity) -> Optional[Agreement]:
    """By Fisher's exact test; None without a value."""
    if len(values) == 0:
        return None
    ours, theirs = count_within(values, quantity), round(paper_pct / 100.0 * TRIALS)
    interval = Interval(*(100.0 * bound for bound in wilson(ours, len(values), LEVEL)))
    _, p_value = stats.fisher_exact([[ours, len(values) - ours], [theirs, TRIALS - theirs]])
    return Agreement(100.0 * ours / len(values), interval, float(p_value))


def compare_max(values: np.ndarray, paper_max: float, quantity: Quantity) -> Optional[Agreement]:
    """By how many of ours lie beyond the paper's maximum; None without a value.

    Were both samples of one distribution, every order of their values would be equally likely.
    Where none of ours lies beyond, nothing can be told: only the paper knows its second largest.
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
    """As `compare_max`, with the signs turned."""
    turned = compare_max(-values, -paper_min, quantity)
    return turned and turned._replace(ours=-turned.ours)


_COMPARISONS: Dict[str, Callable[[np.ndarray, float, Quantity], Optional[Agreement]]] = {
    'min': compare_min,
    'max': compare_max,
    'std': compare_std,
    'pct_within': compare_pct_within,
}
