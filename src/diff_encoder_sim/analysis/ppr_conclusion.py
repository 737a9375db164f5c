"""The comparison of two encoders as a sentence."""

from __future__ import annotations

import math

from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.paired_statistics import PairedResult
from diff_encoder_sim.analysis.ppr_comparison import PprComparison, Question
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.sample_statistics import Interval


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
