"""What the encoder changes: every two PPRs of a test compared over equal trials.

Equal trial numbers drew the same noise with each encoder, so that they are compared in pairs.
"""

from __future__ import annotations

import enum
import itertools
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import Cell, Dataset, TrialData, Varied
from diff_encoder_sim.analysis.final_errors import equal_trials, final_errors
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.table_keys import ppr_head
from diff_encoder_sim.evaluation.sample_statistics import (
    SIGNIFICANCE,
    Interval,
    PairedResult,
    holm,
    mcnemar,
    spread_ratio,
    wilcoxon,
)
from diff_encoder_sim.trials.pose_source import PoseSource

# Equal pulse counts give equal errors but for rounding, which must not look like a spread.
DECIMALS = 9


class Question(enum.Enum):
    """In what two encoders may differ."""

    SPREAD = 'spread'  # standard deviation: estimate is a ratio
    ERROR = 'error'  # absolute value: estimate is a difference
    WITHIN = 'within'  # share within tolerance: estimate is a difference


class PprComparison(NamedTuple):
    """One question about two encoders in one test, by one source."""

    test: str
    varied: Varied
    source: PoseSource
    quantity: Quantity
    question: Question
    pprs: Tuple[str, str]  # the coarser first
    result: PairedResult  # of the coarser against the finer
    p_adjusted: float  # by Holm, over all comparisons of equal source and question

    @property
    def is_distinguishable(self) -> bool:
        """Whether the encoders differ, the number of comparisons considered."""
        return self.p_adjusted < SIGNIFICANCE

    @property
    def verdict(self) -> str:
        """In words."""
        result, (more, less) = self.result, map(ppr_head, self.pprs)
        nothing = 1.0 if self.question is Question.SPREAD else 0.0
        if not self.is_distinguishable:
            return f'{more} and {less} are not distinguishable with {result.pairs} trials'
        if result.estimate < nothing:
            result, (more, less) = _swapped(result, self.question), (less, more)
        return f'{more} {_told(result, less, self.question, self.quantity)}'


def compare_pprs(dataset: Dataset) -> List[PprComparison]:
    """All questions, sources and axes of every two PPRs of equal test and parameters.

    Trials without a final pose in one of the two are left out.
    """
    compared = [
        PprComparison(coarse.test, coarse.varied, source, quantity, question, (coarse.ppr, fine.ppr), result, 1.0)
        for (coarse, first), (fine, second) in _cells_in_pairs(dataset.cells())
        for source in PoseSource
        for quantity in QUANTITIES
        for question, result in _answers(first, second, source, quantity)
    ]
    for source, question in itertools.product(PoseSource, Question):
        _adjust(
            compared, [index for index, one in enumerate(compared) if (one.source, one.question) == (source, question)]
        )
    return compared


def _adjust(compared: List[PprComparison], family: Sequence[int]) -> None:
    """Correct the p-values at these indices for their number, in place."""
    adjusted = holm([compared[index].result.p_value for index in family])
    for index, p_value in zip(family, adjusted):
        compared[index] = compared[index]._replace(p_adjusted=p_value)


_CellTrials = Tuple[Cell, List[TrialData]]


def _cells_in_pairs(cells: Dict[Cell, List[TrialData]]) -> Iterator[Tuple[_CellTrials, _CellTrials]]:
    for first, second in itertools.combinations(cells.items(), 2):
        if (first[0].test, first[0].varied) == (second[0].test, second[0].varied):
            yield first, second


def _answers(
    first: Sequence[TrialData], second: Sequence[TrialData], source: PoseSource, quantity: Quantity
) -> List[Tuple[Question, PairedResult]]:
    pairs = equal_trials(first, second, source)
    if not pairs[0]:
        return []
    errors = [np.round(final_errors(trials, source, quantity), DECIMALS) for trials in pairs]
    sizes = [np.abs(values) for values in errors]
    return [
        (Question.SPREAD, spread_ratio(*errors)),
        (Question.ERROR, wilcoxon(*sizes)),
        (Question.WITHIN, mcnemar(*(size <= quantity.tolerance for size in sizes))),
    ]


def _swapped(result: PairedResult, question: Question) -> PairedResult:
    """The second against the first."""
    low, high = result.interval
    if question is Question.SPREAD:
        return result._replace(estimate=_inverse(result.estimate), interval=Interval(_inverse(high), _inverse(low)))
    return result._replace(estimate=-result.estimate, interval=Interval(-high, -low))


def _inverse(value: float) -> float:
    return 1.0 / value if value > 0.0 else np.inf


def _told(result: PairedResult, other: str, question: Question, quantity: Quantity) -> str:
    low, high = result.interval
    if question is Question.SPREAD:
        if np.isinf(result.estimate):
            return f'spreads, {other} does not: all its {result.pairs} errors are equal'
        return f'spreads more than {other} (ratio {result.estimate:.3g}, 95 % interval {low:.3g} to {high:.3g})'
    if question is Question.ERROR:
        return (
            f'is farther off than {other} (by {result.estimate:.2g} {quantity.unit}, '
            f'95 % interval {low:.2g} to {high:.2g})'
        )
    return (
        f'is within {quantity.tolerance:g} {quantity.unit} more often than {other} (by '
        f'{100.0 * result.estimate:.0f} points, 95 % interval {100.0 * low:.0f} to '
        f'{100.0 * high:.0f})'
    )
