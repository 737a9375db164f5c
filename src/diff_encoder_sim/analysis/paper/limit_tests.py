"""Hypothesis tests of errors against a limit. The limit is taken as printed: it is no sample."""

from __future__ import annotations

import math
from typing import Callable, List, Sequence

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.final_errors import count_within
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.paper.claim_samples import Sample
from diff_encoder_sim.analysis.paper.hypothesis_tests import HypothesisTest, PartResult, concluded, too_few
from diff_encoder_sim.analysis.sample_statistics import Interval, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred

stats = deferred('scipy.stats')


def fractions_within(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the fractions within tolerance are above, or below, `limit`, by the score test of Wilson's interval."""
    return _against_limit(lambda one, is_above: _fraction_part(one, limit, is_above), above, below, 1)


def spreads(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the standard deviations are above, or below, `limit`, by chi-square."""
    return _against_limit(lambda one, is_above: _spread_part(one, limit, is_above), above, below, 2)


def _against_limit(
    part_of: Callable[[Sample, bool], PartResult], above: Sequence[Sample], below: Sequence[Sample], fewest: int
) -> List[HypothesisTest]:
    """Test each sample that has at least `fewest` values."""
    sides = [*((one, True) for one in above), *((one, False) for one in below)]
    return [
        *(too_few(one.label) for one, _ in sides if len(one.values) < fewest),
        *concluded(part_of(one, is_above) for one, is_above in sides if len(one.values) >= fewest),
    ]


def _fraction_part(one: Sample, limit: float, is_above: bool) -> PartResult:
    within, trials = count_within(one.values, one.quantity), len(one.values)
    interval = wilson(within, trials, LEVEL)
    deviation = (within / trials - limit) / math.sqrt(limit * (1.0 - limit) / trials)
    p_value = 2.0 * float(stats.norm.sf(abs(deviation)))
    counts = f'{one.label}: {within} of {trials} within'
    text = f'{counts}, 95 % interval {100.0 * interval.low:.0f} to {100.0 * interval.high:.0f} %'
    return _part(text, within / trials, limit, is_above, p_value)


def _spread_part(one: Sample, limit: float, is_above: bool) -> PartResult:
    std, freedom, interval = spread(one.values) or 0.0, len(one.values) - 1, std_interval(one.values, LEVEL)
    squares = freedom * (std / limit) ** 2
    p_value = 2.0 * float(min(stats.chi2.cdf(squares, freedom), stats.chi2.sf(squares, freedom)))
    text = f'{one.label}: standard deviation {std:.3g} {one.quantity.unit}, 95 % interval {_range(interval)}'
    return _part(text, std, limit, is_above, p_value)


def _part(text: str, value: float, limit: float, is_above: bool, p_value: float) -> PartResult:
    """Conclude from the two-sided p-value of a value that equals the limit."""
    is_as_claimed = value > limit if is_above else value < limit
    return PartResult(text, is_as_claimed and p_value < SIGNIFICANCE, 1.0 if is_as_claimed else p_value)


def _range(interval: Interval) -> str:
    return f'{interval.low:.3g} to {interval.high:.3g}'
