"""Which encoders the trials tell apart, and in what: equal trials compared in pairs."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.ppr_comparison import PprComparison, Question
from diff_encoder_sim.analysis.table_files import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import head_of_test
from diff_encoder_sim.evaluation.sample_statistics import SIGNIFICANCE
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource

# What the worse of two encoders does.
HEADS = {
    Question.SPREAD: 'spreads more',
    Question.ERROR: 'is farther off',
    Question.WITHIN: 'is within tolerance less often',
}

NOTHING = '–'


class EncoderComparison(NamedTuple):
    """What the page says of encoders."""

    count: int  # of comparisons
    table: Optional[Table]  # of the differences; None where there are none
    verdicts: Dict[str, List[str]]  # by test: a sentence for each difference


def compare_encoders(compared: Sequence[PprComparison]) -> EncoderComparison:
    """Only what differs, all comparisons of the dataset considered, is told."""
    tests = list(dict.fromkeys(map(_test, compared)))
    different = sorted(
        (one for one in compared if one.is_distinguishable),
        key=lambda one: (tests.index(_test(one)), list(PoseSource).index(one.source), one.quantity.component),
    )
    verdicts: Dict[str, List[str]] = {}
    for one in different:
        verdicts.setdefault(_test(one), []).append(f'{_error(one)}: {one.verdict}.')
    return EncoderComparison(len(compared), _table(different, len(compared)), verdicts)


def _table(different: Sequence[PprComparison], count: int) -> Optional[Table]:
    """A row for each test, source and axis in which encoders differ."""
    if not different:
        return None
    by_row: Dict[Tuple[str, str], List[PprComparison]] = {}
    for one in different:
        by_row.setdefault((_test(one), _error(one)), []).append(one)
    columns = [
        Column('test', 'test'),
        Column('error', 'error'),
        *(Column(question.value, head) for question, head in HEADS.items()),
    ]
    rows: List[List[Entry]] = [
        [*key, *(_worse(of_row, question) for question in HEADS)] for key, of_row in by_row.items()
    ]
    return Table(
        'encoders',
        'Encoders that differ',
        columns,
        rows,
        [
            f'To be read as: 40 spreads more than 1024 and 4096. Told where p is below '
            f"{SIGNIFICANCE:g} after Holm's correction, over all comparisons of a source in a column; "
            f'in all others of {count} the encoders are not distinguishable with these trials.'
        ],
    )


def _worse(compared: Sequence[PprComparison], question: Question) -> str:
    """Which encoder does worse than which others."""
    others: Dict[str, List[str]] = {}
    for one in compared:
        if one.question is question:
            worse, better = one.pprs if _is_first_worse(one) else one.pprs[::-1]
            others.setdefault(worse, []).append(better)
    return '; '.join(f'{worse} than {", ".join(better)}' for worse, better in others.items()) or NOTHING


def _is_first_worse(one: PprComparison) -> bool:
    if one.question is Question.WITHIN:
        return one.result.estimate < 0.0
    return one.result.estimate > (1.0 if one.question is Question.SPREAD else 0.0)


def _test(one: PprComparison) -> str:
    return head_of_test(one.test, one.varied)


def _error(one: PprComparison) -> str:
    return f'{TOPIC_OF_SOURCE[one.source]}, {one.quantity.axis}'
