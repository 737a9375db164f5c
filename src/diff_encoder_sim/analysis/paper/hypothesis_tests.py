"""What our trials say of each part of a claim: it holds, it fails, or they do not tell.

A claim has many parts (tests, encoders, axes) and holds when all of them do, for which 95 % in each
are enough. It fails when one of them does; that this is not luck is kept at 95 % for all parts
together, by Holm for p-values and by Bonferroni for intervals.
"""

from __future__ import annotations

import enum
from typing import Callable, List, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.analysis.final_errors import count_within, with_final_error
from diff_encoder_sim.analysis.paper.claim_samples import Pair, Sample, TrialsByCell
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.evaluation.sample_statistics import (
    SIGNIFICANCE,
    Interval,
    holm,
    mcnemar,
    spread,
    spread_ratio,
    std_interval,
    wilcoxon,
    wilson,
)
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

# Of the tolerance: a difference below that is negligible.
NEGLIGIBLE_FRACTION = 0.1

# Thirty trials of thirty in both cells tell no more than 9 points.
EQUAL_FRACTIONS_MARGIN = 0.15


class Finding(enum.Enum):
    """What a part of a claim came to."""

    HOLDS = 'holds'
    FAILS = 'fails'
    UNCLEAR = 'unclear'


class Evidence(NamedTuple):
    """One part of a claim."""

    finding: Finding
    text: str  # with the numbers


class _Difference(NamedTuple):
    """Between the two of a pair."""

    p_value: float
    is_first_larger: bool
    text: str


def first_spreads_more(pairs: Sequence[Pair]) -> List[Evidence]:
    """The first of each pair has the larger standard deviation: the ratio's jackknife."""
    return _compared(pairs, _test_spreads)


def first_errs_more(pairs: Sequence[Pair]) -> List[Evidence]:
    """The first of each pair is farther off, as a rule: Wilcoxon's signed-rank test."""
    return _compared(pairs, _test_sizes)


def fractions_within(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[Evidence]:
    """The shares within tolerance are above, or below, `limit`: Wilson's interval."""

    def interval(one: Sample, level: float) -> Interval:
        return wilson(count_within(one.values, one.quantity), len(one.values), level)

    def told(one: Sample, found: Interval) -> str:
        return (
            f'{count_within(one.values, one.quantity)} of {len(one.values)} within, '
            f'{100.0 * found.low:.0f} to {100.0 * found.high:.0f} per cent'
        )

    return _placed(limit, above, below, 1, interval, told)


def spreads(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[Evidence]:
    """The standard deviations are above, or below, `limit`: the chi-square interval."""

    def told(one: Sample, found: Interval) -> str:
        return f'spread {spread(one.values):.3g}, {found.low:.3g} to {found.high:.3g} {one.quantity.unit}'

    return _placed(limit, above, below, 2, lambda one, level: std_interval(one.values, level), told)


def fractions_equal(pairs: Sequence[Pair]) -> List[Evidence]:
    """The shares within tolerance differ by less than EQUAL_FRACTIONS_MARGIN: McNemar's test."""
    insides = [[np.abs(values) <= pair.quantity.tolerance for values in pair.values] for pair in pairs]
    results = [mcnemar(*inside, 1.0 - SIGNIFICANCE) for inside in insides]
    evidence = []
    for pair, inside, result, adjusted in zip(pairs, insides, results, holm([result.p_value for result in results])):
        finding = Finding.UNCLEAR
        if max(-result.interval.low, result.interval.high) < EQUAL_FRACTIONS_MARGIN:
            finding = Finding.HOLDS
        elif adjusted < SIGNIFICANCE:
            finding = Finding.FAILS
        counts = [np.count_nonzero(of_one) for of_one in inside]
        evidence.append(
            Evidence(
                finding,
                f'{pair.label}: {counts[0]} and {counts[1]} of {result.pairs} within with '
                f'{pair.names[0]} and {pair.names[1]}',
            )
            if result.pairs
            else _nothing(pair.label)
        )
    return evidence


def all_within(samples: Sequence[Sample]) -> List[Evidence]:
    """Every error is within tolerance: a statement of these trials, so one outside refutes it."""
    evidence = []
    for one in samples:
        within, trials = count_within(one.values, one.quantity), len(one.values)
        finding = Finding.HOLDS if within == trials else Finding.FAILS
        evidence.append(
            Evidence(finding, f'{one.label}: {within} of {trials} within') if trials else _nothing(one.label)
        )
    return evidence


def _compared(pairs: Sequence[Pair], test: Callable[[Pair], _Difference]) -> List[Evidence]:
    tested = [pair for pair in pairs if len(pair.values[0]) > 2]
    differences = [test(pair) for pair in tested]
    evidence = [_nothing(pair.label) for pair in pairs if len(pair.values[0]) <= 2]
    for pair, difference, adjusted in zip(
        tested, differences, holm([difference.p_value for difference in differences])
    ):
        finding = Finding.UNCLEAR
        if difference.is_first_larger and difference.p_value < SIGNIFICANCE:
            finding = Finding.HOLDS
        elif not difference.is_first_larger and adjusted < SIGNIFICANCE:
            finding = Finding.FAILS
        evidence.append(Evidence(finding, f'{pair.label}: {difference.text}, p {difference.p_value:.2g}'))
    return evidence


def _test_spreads(pair: Pair) -> _Difference:
    result = spread_ratio(*pair.values)
    first, second = map(spread, pair.values)
    return _Difference(
        result.p_value,
        first > second,
        f'spread {first:.3g} {pair.names[0]}, {second:.3g} {pair.names[1]} {pair.quantity.unit}',
    )


def _test_sizes(pair: Pair) -> _Difference:
    first, second = (float(np.median(np.abs(values))) for values in pair.values)
    return _Difference(
        wilcoxon(*map(np.abs, pair.values)).p_value,
        first > second,
        f'median error {first:.3g} {pair.names[0]}, {second:.3g} {pair.names[1]} {pair.quantity.unit}',
    )


def all_reached(trials: TrialsByCell) -> List[Evidence]:
    """Every trial came to its goal."""
    evidence = []
    for (test, ppr), of_cell in trials.items():
        reached = sum(trial.outcome is Outcome.SUCCEEDED for trial in of_cell)
        evidence.append(
            Evidence(
                Finding.HOLDS if reached == len(of_cell) else Finding.FAILS,
                f'{test} at {ppr} PPR: {reached} of {len(of_cell)} reached the goal',
            )
        )
    return evidence


def amcl_matches_global(trials: TrialsByCell) -> List[Evidence]:
    """At the end /amcl_pose and /global_pose agree to a tenth of the tolerance, in every trial."""
    evidence = []
    for (test, ppr), of_cell in trials.items():
        both = [
            (trial.errors[PoseSource.AMCL], trial.errors[PoseSource.GLOBAL])
            for trial in with_final_error(with_final_error(of_cell, PoseSource.AMCL), PoseSource.GLOBAL)
        ]
        if not both:
            evidence.append(_nothing(f'{test} at {ppr} PPR'))
            continue
        turned = np.array(both)[:, 0] - np.array(both)[:, 1]
        turned[:, 2] = wrap_angle(turned[:, 2])
        largest = np.abs(turned).max(axis=0) * [quantity.scale for quantity in QUANTITIES]
        agree = largest <= NEGLIGIBLE_FRACTION * np.array([one.tolerance for one in QUANTITIES])
        evidence.append(
            Evidence(
                Finding.HOLDS if agree.all() else Finding.FAILS,
                f'{test} at {ppr} PPR: largest differences '
                + ', '.join(
                    f'{value:.3g} {quantity.unit} in {quantity.axis}' for value, quantity in zip(largest, QUANTITIES)
                ),
            )
        )
    return evidence


def _placed(
    limit: float,
    above: Sequence[Sample],
    below: Sequence[Sample],
    fewest: int,
    interval: Callable[[Sample, float], Interval],
    told: Callable[[Sample, Interval], str],
) -> List[Evidence]:
    strict, evidence = SIGNIFICANCE / max(1, len(above) + len(below)), []
    for one, is_above in [*((one, True) for one in above), *((one, False) for one in below)]:
        if len(one.values) < fewest:
            evidence.append(_nothing(one.label))
            continue
        plain, wide = interval(one, 1.0 - SIGNIFICANCE), interval(one, 1.0 - strict)
        finding = Finding.UNCLEAR
        if (plain.low > limit) if is_above else (plain.high < limit):
            finding = Finding.HOLDS
        elif (wide.high < limit) if is_above else (wide.low > limit):
            finding = Finding.FAILS
        evidence.append(Evidence(finding, f'{one.label}: {told(one, plain)}'))
    return evidence


def _nothing(label: str) -> Evidence:
    return Evidence(Finding.UNCLEAR, f'{label}: too few trials')
