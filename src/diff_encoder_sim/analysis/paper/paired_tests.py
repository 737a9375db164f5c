"""Hypothesis tests of pairs of errors of equal trials."""

from __future__ import annotations

from typing import Callable, List, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.analysis.final_errors import count_within
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE, PairedResult, mcnemar, spread_ratio, wilcoxon
from diff_encoder_sim.analysis.paper.claim_samples import Pair
from diff_encoder_sim.analysis.paper.hypothesis_tests import HypothesisTest, PartResult, concluded, too_few
from diff_encoder_sim.analysis.sample_statistics import spread

# 30 of 30 trials in both cells bound the difference by 9 percentage points, no closer.
EQUAL_FRACTIONS_MARGIN = 0.15

# Fewer pairs have no test of their spreads.
FEWEST_PAIRS = 3


class _Difference(NamedTuple):
    """The difference between the two of a pair."""

    p_value: float
    is_first_larger: bool
    text: str


def first_spreads_more(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger standard deviation, by the ratio's jackknife."""
    return _compared(pairs, _test_spreads)


def first_errs_more(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger absolute errors, by Wilcoxon's signed-rank test."""
    return _compared(pairs, _test_sizes)


def fractions_equal(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the fractions within tolerance differ by less than EQUAL_FRACTIONS_MARGIN, by McNemar's test."""
    return [
        *(too_few(pair.label) for pair in pairs if not len(pair.values[0])),
        *concluded(_equal_fractions(pair, _mcnemar(pair)) for pair in pairs if len(pair.values[0])),
    ]


def _mcnemar(pair: Pair) -> PairedResult:
    first, second = (np.abs(values) <= pair.quantity.tolerance for values in pair.values)
    return mcnemar(first, second, 1.0 - SIGNIFICANCE)


def _equal_fractions(pair: Pair, result: PairedResult) -> PartResult:
    is_equal = max(-result.interval.low, result.interval.high) < EQUAL_FRACTIONS_MARGIN
    first, second = (count_within(values, pair.quantity) for values in pair.values)
    counts = f'within tolerance {first} ({pair.names[0]}) and {second} ({pair.names[1]}) of {result.pairs}'
    return PartResult(f'{pair.label}: {counts}', is_equal, 1.0 if is_equal else result.p_value)


def _compared(pairs: Sequence[Pair], difference_of: Callable[[Pair], _Difference]) -> List[HypothesisTest]:
    """Test that the first of each pair is the larger; pairs with too few trials come first."""
    return [
        *(too_few(pair.label) for pair in pairs if len(pair.values[0]) < FEWEST_PAIRS),
        *concluded(_is_larger(pair, difference_of(pair)) for pair in pairs if len(pair.values[0]) >= FEWEST_PAIRS),
    ]


def _is_larger(pair: Pair, difference: _Difference) -> PartResult:
    text = f'{pair.label}: {difference.text}, p {difference.p_value:.2g}'
    if difference.is_first_larger:
        return PartResult(text, difference.p_value < SIGNIFICANCE, 1.0)
    return PartResult(text, False, difference.p_value)


def _test_spreads(pair: Pair) -> _Difference:
    result = spread_ratio(*pair.values)
    first, second = (spread(values) or 0.0 for values in pair.values)
    return _Difference(result.p_value, first > second, f'standard deviation {_both(pair, first, second)}')


def _test_sizes(pair: Pair) -> _Difference:
    sizes_a, sizes_b = (np.abs(values) for values in pair.values)
    first, second = float(np.median(sizes_a)), float(np.median(sizes_b))
    result = wilcoxon(sizes_a, sizes_b)
    return _Difference(result.p_value, first > second, f'median absolute error {_both(pair, first, second)}')


def _both(pair: Pair, first: float, second: float) -> str:
    unit, (name_a, name_b) = pair.quantity.unit, pair.names
    return f'{first:.3g} {unit} ({name_a}), {second:.3g} {unit} ({name_b})'
