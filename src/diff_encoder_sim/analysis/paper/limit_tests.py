"""Hypothesis tests of errors against a limit."""

from __future__ import annotations

from typing import Callable, List, Sequence

from diff_encoder_sim.analysis.final_errors import count_within
from diff_encoder_sim.analysis.paper.claim_samples import Sample
from diff_encoder_sim.analysis.paper.hypothesis_tests import Conclusion, HypothesisTest, holds_if, too_few
from diff_encoder_sim.evaluation.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.evaluation.sample_statistics import Interval, spread, std_interval, wilson

_IntervalOf = Callable[[Sample, float], Interval]  # at a level of confidence
_TextOf = Callable[[Sample, Interval], str]


def fractions_within(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the fractions within tolerance are above, or below, `limit`, by Wilson's interval."""
    return _against_limit(limit, above, below, 1, _fraction_interval, _fraction_text)


def spreads(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the standard deviations are above, or below, `limit`, by the chi-square interval."""
    return _against_limit(limit, above, below, 2, lambda one, level: std_interval(one.values, level), _std_text)


def all_within(samples: Sequence[Sample]) -> List[HypothesisTest]:
    """Test that every error is within tolerance: one outside refutes it."""
    tests = []
    for one in samples:
        within, trials = count_within(one.values, one.quantity), len(one.values)
        text = f'{one.label}: {within} of {trials} within'
        tests.append(holds_if(within == trials, text) if trials else too_few(one.label))
    return tests


def _fraction_interval(one: Sample, level: float) -> Interval:
    return wilson(count_within(one.values, one.quantity), len(one.values), level)


def _fraction_text(one: Sample, found: Interval) -> str:
    counts = f'{count_within(one.values, one.quantity)} of {len(one.values)} within'
    return f'{counts}, 95 % interval {100.0 * found.low:.0f} to {100.0 * found.high:.0f} %'


def _std_text(one: Sample, found: Interval) -> str:
    interval = f'95 % interval {found.low:.3g} to {found.high:.3g}'
    return f'standard deviation {spread(one.values):.3g} {one.quantity.unit}, {interval}'


def _against_limit(
    limit: float,
    above: Sequence[Sample],
    below: Sequence[Sample],
    fewest: int,
    interval_of: _IntervalOf,
    text_of: _TextOf,
) -> List[HypothesisTest]:
    """Compare the interval of each sample with the limit; `fewest` values have an interval."""
    corrected = SIGNIFICANCE / max(1, len(above) + len(below))
    tests = []
    for one, is_above in [*((one, True) for one in above), *((one, False) for one in below)]:
        if len(one.values) < fewest:
            tests.append(too_few(one.label))
            continue
        plain, wide = interval_of(one, 1.0 - SIGNIFICANCE), interval_of(one, 1.0 - corrected)
        tests.append(HypothesisTest(_side(plain, wide, limit, is_above), f'{one.label}: {text_of(one, plain)}'))
    return tests


def _side(plain: Interval, wide: Interval, limit: float, is_above: bool) -> Conclusion:
    """Conclude from the plain interval that the part holds, from the corrected one that it fails."""
    if (plain.low > limit) if is_above else (plain.high < limit):
        return Conclusion.HOLDS
    if (wide.high < limit) if is_above else (wide.low > limit):
        return Conclusion.FAILS
    return Conclusion.UNCLEAR
