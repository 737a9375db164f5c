"""Which encoders are distinguishable, and in what: equal trials compared in pairs."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.dataset import distinct
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.ppr_comparison import PprComparison, Question
from diff_encoder_sim.analysis.ppr_conclusion import conclusion
from diff_encoder_sim.analysis.table import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import setup_text
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

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
