"""Compares the encoders: every two PPRs of a test over equal trials.

Equal trial numbers draw the same noise with each encoder, so that they are compared in pairs.
"""

from __future__ import annotations

import enum
import itertools
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData, Varied
from diff_encoder_sim.analysis.final_errors import equal_trials, final_errors
from diff_encoder_sim.analysis.paired_statistics import (
    SIGNIFICANCE,
    PairedResult,
    holm,
    mcnemar,
    spread_ratio,
    wilcoxon,
)
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.drives.topics import PoseSource

# Equal pulse counts give equal errors but for rounding, which must not look like a spread.
DECIMALS = 9


class Question(enum.Enum):
    """In what two encoders may differ."""

    SPREAD = 'spread'  # standard deviation: estimate is a ratio
    ERROR = 'error'  # absolute value: estimate is a difference
    WITHIN = 'within'  # fraction within tolerance: estimate is a difference

    @property
    def no_difference(self) -> float:
        """Return the estimate for equal encoders."""
        return 1.0 if self is Question.SPREAD else 0.0


class PprComparison(NamedTuple):
    """One question about two encoders in one test, by one pose source."""

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
        """Return whether the encoders differ, corrected for the number of comparisons."""
        return self.p_adjusted < SIGNIFICANCE


def compare_pprs(dataset: Dataset) -> List[PprComparison]:
    """Ask all questions of every two PPRs of equal test and parameters, for each source and quantity.

    Trials without a final pose in one of the two are left out.
    """
    compared = [
        PprComparison(coarse.test, coarse.varied, source, quantity, question, (coarse.ppr, fine.ppr), result, 1.0)
        for (coarse, first), (fine, second) in _pairs_of_cells(dataset.cells())
        for source in PoseSource
        for quantity in QUANTITIES
        for question, result in _results(first, second, source, quantity)
    ]
    for family in itertools.product(PoseSource, Question):
        _adjust(compared, [index for index, one in enumerate(compared) if (one.source, one.question) == family])
    return compared


def _adjust(compared: List[PprComparison], family: Sequence[int]) -> None:
    """Correct the p-values at these indices for their number, in place."""
    adjusted = holm([compared[index].result.p_value for index in family])
    for index, p_value in zip(family, adjusted):
        compared[index] = compared[index]._replace(p_adjusted=p_value)


_CellTrials = Tuple[CellKey, List[TrialData]]


def _pairs_of_cells(cells: Dict[CellKey, List[TrialData]]) -> Iterator[Tuple[_CellTrials, _CellTrials]]:
    for first, second in itertools.combinations(cells.items(), 2):
        if (first[0].test, first[0].varied) == (second[0].test, second[0].varied):
            yield first, second


def _results(
    first: Sequence[TrialData], second: Sequence[TrialData], source: PoseSource, quantity: Quantity
) -> List[Tuple[Question, PairedResult]]:
    pairs = equal_trials(first, second, source)
    if not pairs[0]:
        return []
    errors_a, errors_b = (np.round(final_errors(trials, source, quantity), DECIMALS) for trials in pairs)
    sizes_a, sizes_b = np.abs(errors_a), np.abs(errors_b)
    return [
        (Question.SPREAD, spread_ratio(errors_a, errors_b)),
        (Question.ERROR, wilcoxon(sizes_a, sizes_b)),
        (Question.WITHIN, mcnemar(sizes_a <= quantity.tolerance, sizes_b <= quantity.tolerance)),
    ]
