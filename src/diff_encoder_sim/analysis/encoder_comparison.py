"""Compares the encoders: every two PPRs of a test over equal trials, which draw the same noise with each encoder."""

from __future__ import annotations

import enum
import itertools
import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData, Varied, distinct
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.final_errors import equal_trials, final_errors
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.statistics import (
    SIGNIFICANCE,
    Interval,
    PairedResult,
    holm,
    mcnemar,
    spread_ratio,
    wilcoxon,
)
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, setup_text, varied_keys
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

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


def conclusion(one: PprComparison) -> str:
    """Return the result of a comparison as a sentence without its full stop."""
    first, second = map(ppr_text, one.pprs)
    if not one.is_distinguishable:
        return f'{first} and {second} are not distinguishable with {one.result.pairs} trials'
    if one.result.estimate >= one.question.no_difference:
        return f'{first} {_difference(one.result, second, one.question, one.quantity)}'
    return f'{second} {_difference(_swapped(one.result, one.question), first, one.question, one.quantity)}'


def _swapped(result: PairedResult, question: Question) -> PairedResult:
    """Return the result of the second against the first."""
    low, high = result.interval
    if question is Question.SPREAD:
        return result._replace(estimate=_inverse(result.estimate), interval=Interval(_inverse(high), _inverse(low)))
    return result._replace(estimate=-result.estimate, interval=Interval(-high, -low))


def _inverse(value: float) -> float:
    return 1.0 / value if value > 0.0 else math.inf


def _difference(result: PairedResult, other: str, question: Question, quantity: Quantity) -> str:
    low, high = result.interval
    if question is Question.SPREAD:
        if math.isinf(result.estimate):
            return f'spreads, {other} does not: all its {result.pairs} errors are equal'
        return f'spreads more than {other} (ratio {result.estimate:.3g}, 95 % interval {low:.3g} to {high:.3g})'
    if question is Question.ERROR:
        by = f'{result.estimate:.2g} {quantity.unit}, 95 % interval {low:.2g} to {high:.2g}'
        return f'has larger errors than {other} (by {by})'
    points = f'{100.0 * result.estimate:.0f} percentage points, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f}'
    return f'is within {quantity.tolerance:g} {quantity.unit} more often than {other} (by {points})'


DECIMALS_COMPARISON_TABLE = 4

_NAMES = ('source', 'question', 'error', 'ppr_a', 'ppr_b', 'pairs', 'estimate', 'low', 'high', 'p_holm', 'verdict')


def comparison_table(dataset: Dataset, compared: Sequence[PprComparison]) -> Table:
    """Build a table with a row for each of the dataset's comparisons.

    The estimate is of a against b: for `spread` the ratio of standard deviations, for `error` the
    difference of absolute errors in the unit of the error, for `within` the difference of the
    fractions within tolerance. `low` and `high` are its 95 % interval, for the comparison alone;
    `p_holm` is corrected for the number of comparisons.
    """
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = [[*key_entries(one.test, one.varied, keys), *_entries(one)] for one in compared]
    columns = [*key_columns(keys), *(Column(name, name) for name in _NAMES)]
    return Table('comparisons', 'Encoders compared', columns, rows, [])


def _entries(one: PprComparison) -> List[Entry]:
    """Return an entry for each of `_NAMES`."""
    result = one.result
    return [
        one.source.value,
        one.question.value,
        one.quantity.name,
        *one.pprs,
        Number(result.pairs, 0),
        *(Number(value, DECIMALS_COMPARISON_TABLE) for value in (result.estimate, *result.interval, one.p_adjusted)),
        conclusion(one),
    ]


# What the worse of two encoders does.
HEADS = {
    Question.SPREAD: 'spreads more',
    Question.ERROR: 'has larger errors',
    Question.WITHIN: 'is within tolerance less often',
}

NOTHING = '–'


class EncoderComparison(NamedTuple):
    """The report's section that compares encoders."""

    comparisons: int
    table: Optional[Table]  # of the differences; None where there are none
    conclusions: Dict[str, List[str]]  # by test: a sentence for each difference


def compare_encoders(compared: Sequence[PprComparison]) -> EncoderComparison:
    """Select the comparisons that show a difference, corrected for the number of comparisons."""
    tests, sources = distinct(map(_test, compared)), list(PoseSource)
    different = sorted(
        (one for one in compared if one.is_distinguishable),
        key=lambda one: (tests.index(_test(one)), sources.index(one.source), one.quantity.component),
    )
    conclusions: Dict[str, List[str]] = {}
    for one in different:
        conclusions.setdefault(_test(one), []).append(f'{_error(one)}: {conclusion(one)}.')
    return EncoderComparison(len(compared), _table(different, len(compared)), conclusions)


def _table(different: Sequence[PprComparison], count: int) -> Optional[Table]:
    """Build a row for each test, source and quantity in which encoders differ."""
    if not different:
        return None
    by_row: Dict[Tuple[str, str], List[PprComparison]] = {}
    for one in different:
        by_row.setdefault((_test(one), _error(one)), []).append(one)
    heads = [Column(question.value, head) for question, head in HEADS.items()]
    rows: List[List[Entry]] = [
        [*key, *(_worse(of_row, question) for question in HEADS)] for key, of_row in by_row.items()
    ]
    note = (
        f'Read as: 40 PPR spreads more than 1024 and 4096 PPR. Listed where p is below {SIGNIFICANCE:g} after '
        f"Holm's correction, over all comparisons of a source in a column; in all others of {count} the "
        f'encoders are not distinguishable with these trials.'
    )
    columns = [Column('test', 'test'), Column('error', 'error'), *heads]
    return Table('encoders', 'Encoders that differ [PPR]', columns, rows, [note])


def _worse(compared: Sequence[PprComparison], question: Question) -> str:
    """Name which encoder does worse than which others."""
    others: Dict[str, List[str]] = {}
    for one in compared:
        if one.question is question:
            worse, better = one.pprs if _is_first_worse(one) else one.pprs[::-1]
            others.setdefault(worse, []).append(better)
    return '; '.join(f'{worse} than {", ".join(better)}' for worse, better in others.items()) or NOTHING


def _is_first_worse(one: PprComparison) -> bool:
    if one.question is Question.WITHIN:
        return one.result.estimate < one.question.no_difference
    return one.result.estimate > one.question.no_difference


def _test(one: PprComparison) -> str:
    return setup_text(one.test, one.varied)


def _error(one: PprComparison) -> str:
    return f'{TOPIC_OF_SOURCE[one.source]}, {one.quantity.axis}'
