"""Hypothesis tests of the paper's claims on our trials.

A claim has several parts (tests, encoders, quantities). It holds if all parts hold, each with 95 % confidence. It fails
if one part fails, with 95 % confidence over all parts (Holm).
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.paper.paper_cells import PPRS, TRIALS, load_claims
from diff_encoder_sim.analysis.quantities import LEVEL, POSES, QUANTITIES, YAW, Quantity, X, Y
from diff_encoder_sim.analysis.results_table import (
    STANDARD_TESTS,
    SUCCEEDED,
    Results,
    are_within,
    equal_trials,
    final_errors,
    varied_texts,
)
from diff_encoder_sim.analysis.statistics import (
    SIGNIFICANCE,
    holm,
    mcnemar,
    spread,
    spread_ratio,
    std_interval,
    wilcoxon,
    wilson,
)
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.se2 import wrap_angles

stats = deferred('scipy.stats')

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = list(itertools.product(COARSE, FINE))
EXTREMES = [(PPRS[0], PPRS[-1])]

EQUAL_FRACTIONS_MARGIN = 0.15  # 30 of 30 trials in both cells only bound the difference to 9 percentage points
FEWEST_PAIRS = 3  # minimum for a test of spreads
NEGLIGIBLE_FRACTION = 0.1  # of the tolerance
SMALLEST_P = 1e-4  # lower limit of displayed p-values


HOLDS, FAILS, UNCLEAR = CONCLUSIONS = ('holds', 'fails', 'unclear')  # of a hypothesis test


class HypothesisTest(NamedTuple):
    """Test of one part of a claim."""

    conclusion: str  # of CONCLUSIONS
    text: str  # with the numbers
    p_against: Optional[float] = None  # corrected for the number of parts; None without enough trials


class Errors(NamedTuple):
    """Errors tested by a part of a claim: one sample, or pairs of equal trials."""

    label: str  # in the report
    quantity: Quantity
    values: Tuple[np.ndarray, ...]  # (n,) each, in the quantity's unit
    names: Tuple[str, ...] = ()  # of the two samples of pairs


# Result of a part before correction: text with the numbers, whether it is as claimed, whether this is significant, and
# the p-value against the part if it is not as claimed.
_Judged = Tuple[str, bool, bool, float]


def _tested(parts: Sequence[Errors], fewest: int, judge: Callable[[Errors], _Judged]) -> List[HypothesisTest]:
    """Test all parts of a claim that have enough values; the others come first."""
    enough = [judge(part) for part in parts if len(part.values[0]) >= fewest]
    return _concluded([part.label for part in parts if len(part.values[0]) < fewest], enough)


def _concluded(too_few: Sequence[str], parts: Sequence[_Judged]) -> List[HypothesisTest]:
    tests = [HypothesisTest(UNCLEAR, f'{label}: too few trials') for label in too_few]
    adjusted = holm([1.0 if is_as_claimed else p_value for _, is_as_claimed, _, p_value in parts])
    for (text, is_as_claimed, is_sure, _), p_value in zip(parts, adjusted):
        unless_fails = HOLDS if is_as_claimed and is_sure else UNCLEAR
        tests.append(HypothesisTest(FAILS if p_value < SIGNIFICANCE else unless_fails, text, p_value))
    return tests


def fractions_within(limit: float, above: Sequence[Errors] = (), below: Sequence[Errors] = ()) -> List[HypothesisTest]:
    """Test that the fractions within tolerance are above, or below, `limit`, by the score test of Wilson's interval.

    The limit is the printed value, without sampling error.
    """

    def judge(one: Errors) -> _Judged:
        within, trials = _count_within(one.values[0], one.quantity), len(one.values[0])
        low, high = wilson(within, trials, LEVEL)
        deviation = (within / trials - limit) / math.sqrt(limit * (1.0 - limit) / trials)
        text = f'{one.label}: {within} of {trials} within, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %'
        p_value = 2.0 * float(stats.norm.sf(abs(deviation)))
        is_as_claimed = within / trials > limit if _is_among(one, above) else within / trials < limit
        return text, is_as_claimed, p_value < SIGNIFICANCE, p_value

    return _tested([*above, *below], 1, judge)


def spreads(limit: float, above: Sequence[Errors] = (), below: Sequence[Errors] = ()) -> List[HypothesisTest]:
    """Test that the standard deviations are above, or below, `limit`, by chi-square."""

    def judge(one: Errors) -> _Judged:
        std, freedom, (low, high) = spread(one.values[0]) or 0.0, len(one.values[0]) - 1, std_interval(one.values[0])
        squares = freedom * (std / limit) ** 2
        p_value = 2.0 * float(min(stats.chi2.cdf(squares, freedom), stats.chi2.sf(squares, freedom)))
        text = f'{one.label}: standard deviation {std:.3g} {one.quantity.unit}, 95 % interval {low:.3g} to {high:.3g}'
        is_as_claimed = std > limit if _is_among(one, above) else std < limit
        return text, is_as_claimed, p_value < SIGNIFICANCE, p_value

    return _tested([*above, *below], 2, judge)


def _is_among(one: Errors, others: Sequence[Errors]) -> bool:
    return any(one is other for other in others)


def first_spreads_more(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger standard deviation, by the ratio's jackknife."""

    def measure(first: np.ndarray, second: np.ndarray) -> Tuple[List[float], float]:
        return [spread(values) or 0.0 for values in (first, second)], spread_ratio(first, second).p_value

    return _first_is_larger(pairs, 'standard deviation', measure)


def first_errs_more(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger absolute errors, by Wilcoxon's signed-rank test."""

    def measure(first: np.ndarray, second: np.ndarray) -> Tuple[List[float], float]:
        sizes = np.abs(first), np.abs(second)
        return [float(np.median(each)) for each in sizes], wilcoxon(*sizes).p_value

    return _first_is_larger(pairs, 'median absolute error', measure)


def _first_is_larger(
    pairs: Sequence[Errors], what: str, measure: Callable[..., Tuple[List[float], float]]
) -> List[HypothesisTest]:
    def judge(pair: Errors) -> _Judged:
        sizes, p_value = measure(*pair.values)
        both = ', '.join(f'{size:.3g} {pair.quantity.unit} ({name})' for size, name in zip(sizes, pair.names))
        text = f'{pair.label}: {what} {both}, p {p_value:.2g}'
        return text, sizes[0] > sizes[1], p_value < SIGNIFICANCE, p_value

    return _tested(pairs, FEWEST_PAIRS, judge)


def fractions_equal(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the fractions within tolerance differ by less than EQUAL_FRACTIONS_MARGIN, by McNemar's test."""

    def judge(pair: Errors) -> _Judged:
        is_first, is_second = (np.abs(values) <= pair.quantity.tolerance for values in pair.values)
        result = mcnemar(is_first, is_second, LEVEL)
        is_equal = max(-result.interval.low, result.interval.high) < EQUAL_FRACTIONS_MARGIN
        first, second = (_count_within(values, pair.quantity) for values in pair.values)
        counts = f'within tolerance {first} ({pair.names[0]}) and {second} ({pair.names[1]}) of {result.pairs}'
        return f'{pair.label}: {counts}', is_equal, is_equal, result.p_value

    return _tested(pairs, 1, judge)


def _count_within(values: np.ndarray, quantity: Quantity) -> int:
    return int(np.sum(np.abs(values) <= quantity.tolerance))


def all_succeeded(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test that every trial reached its goal."""
    is_true = {cell: of_cell['outcome'] == SUCCEEDED for cell, of_cell in trials.groupby(['test', 'ppr'], sort=False)}
    return _every_trial('reached the goal', is_true)


def all_within(trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str]) -> List[HypothesisTest]:
    """Test that every trial ends within tolerance in x and in y."""
    cells = itertools.product(tests, pprs)
    return _every_trial('within', {cell: are_within(_of_cell(trials, *cell), pose, (X, Y)) for cell in cells})


def amcl_matches_global(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test that the final /amcl_pose and /global_pose agree within a tenth of the tolerance in every trial."""
    is_true = {}
    for cell, of_cell in trials.groupby(['test', 'ppr'], sort=False):
        known = of_cell.dropna(subset=['amcl_x_m', 'global_x_m'])
        is_true[cell] = np.ones(len(known), dtype=bool)
        for quantity in QUANTITIES:
            difference = known[quantity.column('amcl')] - known[quantity.column('global')]
            difference = wrap_angles(difference) if quantity is YAW else difference
            is_true[cell] &= quantity.scale * np.abs(difference) <= NEGLIGIBLE_FRACTION * quantity.tolerance
    return _every_trial('agree', is_true)


def _every_trial(what: str, is_true: Dict[Any, Any]) -> List[HypothesisTest]:
    """Compare the counts per cell and in total with those of the paper, where all trials succeeded.

    The paper's 30 of 30 trials are a sample: 29 of 30 of ours do not contradict it (Fisher's exact test, p = 1). The
    total is also tested because a few failures per cell add up. If cells have common noise, its p-value is approximate.

    Args:
        what: the claimed property.
        is_true: whether each trial has it, by test and PPR.
    """
    labelled = {f'{test} at {ppr} PPR': of_cell for (test, ppr), of_cell in is_true.items()}
    counts = [(label, int(sum(each)), len(each), TRIALS) for label, each in labelled.items() if len(each)]
    if len(counts) > 1:
        _, true, ours, theirs = zip(*counts)
        counts.append(('all cells', sum(true), sum(ours), sum(theirs)))
    parts = []
    for label, true_ours, trials, theirs_true in counts:
        _, p_value = stats.fisher_exact(np.array([[true_ours, trials - true_ours], [theirs_true, 0]]))
        compared = f'{true_ours} of {trials} {what}, the paper {theirs_true} of {theirs_true}'
        # If all are true, the p-value is 1.
        parts.append((f'{label}: {compared}, p {p_value:.2g}', true_ours == trials, True, float(p_value)))
    return _concluded([label for label, each in labelled.items() if not len(each)], parts)


def _of_cell(trials: pd.DataFrame, test: str, ppr: str) -> pd.DataFrame:
    return trials[(trials['test'] == test) & (trials['ppr'] == ppr)]


def samples(
    trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str], quantities: Sequence[Quantity]
) -> List[Errors]:
    """Return a sample per cell and quantity; empty if there is no such cell."""
    return [
        Errors(
            f'{POSES[pose]} in {test} at {ppr} PPR, {quantity.axis}',
            quantity,
            (final_errors(_of_cell(trials, test, ppr), pose, quantity),),
        )
        for test, ppr, quantity in itertools.product(tests, pprs, quantities)
    ]


def pairs_of_pprs(
    trials: pd.DataFrame,
    pose: str,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]],
    quantities: Sequence[Quantity],
) -> List[Errors]:
    """Pair equal trials with two encoders; empty if an encoder is missing."""
    pairs = []
    for test, (first, second) in itertools.product(tests, pprs):
        both = equal_trials(_of_cell(trials, test, first), _of_cell(trials, test, second), pose)
        for quantity in quantities:
            values = tuple(final_errors(one, pose, quantity) for one in both)
            label = f'{POSES[pose]} in {test}, {quantity.axis}'
            pairs.append(Errors(label, quantity, values, (f'{first} PPR', f'{second} PPR')))
    return pairs


def pairs_of_y_and_x(trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str]) -> List[Errors]:
    """Pair the y and x errors of each trial."""
    pairs = []
    for test, ppr in itertools.product(tests, pprs):
        values = tuple(final_errors(_of_cell(trials, test, ppr), pose, axis) for axis in (Y, X))
        pairs.append(Errors(f'{POSES[pose]} in {test} at {ppr} PPR', X, values, ('y', 'x')))
    return pairs


def heading_by_resolution(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test the heading over all tests and in all three tables, because the claim does not name any."""
    of_tests = trials[trials['test'].isin(STANDARD_TESTS)]
    above, below = (
        [
            Errors(
                f'{POSES[pose]} at {ppr} PPR, {YAW.axis}',
                YAW,
                (final_errors(of_tests[of_tests['ppr'] == ppr], pose, YAW),),
            )
            for pose, ppr in itertools.product(('odom', 'global', 'world'), pprs)
        ]
        for pprs in (FINE, COARSE)
    )
    return fractions_within(0.9, above, below)


# Hypothesis tests of each claim of config/paper/claims.csv.
CLAIMS: Dict[str, Callable[[pd.DataFrame], List[HypothesisTest]]] = {
    'routes': all_succeeded,
    'straight_heading': lambda trials: spreads(YAW.tolerance, below=samples(trials, 'odom', ['SL'], PPRS, [YAW])),
    'turns': lambda trials: first_spreads_more(pairs_of_pprs(trials, 'odom', ['SMT'], COARSE_AND_FINE, QUANTITIES)),
    'steadier': lambda trials: first_spreads_more(
        pairs_of_pprs(trials, 'odom', STANDARD_TESTS, COARSE_AND_FINE, QUANTITIES)
    ),
    'drift': lambda trials: first_errs_more(pairs_of_pprs(trials, 'odom', ['DLD'], EXTREMES, [X, Y])),
    'true_position': lambda trials: first_spreads_more(
        pairs_of_pprs(trials, 'world', STANDARD_TESTS, EXTREMES, [X, Y])
    ),
    'across': lambda trials: first_spreads_more(
        [pair for source in ('odom', 'world') for pair in pairs_of_y_and_x(trials, source, ['SL', 'DLD'], PPRS)]
    ),
    'long_drive_spread': lambda trials: spreads(0.05, above=samples(trials, 'odom', ['DLD'], PPRS, [X, Y])),
    'long_drive_within': lambda trials: fractions_within(0.2, below=samples(trials, 'odom', ['DLD'], PPRS, [X, Y])),
    'amcl_within': lambda trials: all_within(trials, 'global', STANDARD_TESTS, PPRS),
    'true_within': lambda trials: fractions_within(0.85, above=samples(trials, 'world', STANDARD_TESTS, PPRS, [X, Y])),
    'heading': heading_by_resolution,
    'true_heading': lambda trials: first_spreads_more(pairs_of_pprs(trials, 'world', ['DLD'], EXTREMES, [YAW])),
    'amcl_resolution': lambda trials: fractions_equal(
        pairs_of_pprs(trials, 'global', STANDARD_TESTS, EXTREMES, [X, Y])
    ),
    'amcl_global': amcl_matches_global,
}


class ClaimResult(NamedTuple):
    """Claim with the results of its tests."""

    text: str
    where: str  # in the paper
    conclusion: str
    tests: List[HypothesisTest]

    @property
    def p_text(self) -> str:
        """Return the smallest p-value of the parts; empty if none was tested."""
        p_value = min((test.p_against for test in self.tests if test.p_against is not None), default=None)
        return '' if p_value is None else f'p {p_value:.2g}' if p_value >= SMALLEST_P else f'p < {SMALLEST_P:g}'

    @property
    def counts(self) -> str:
        """Count the parts of the claim by their conclusions."""
        counts = Counter(test.conclusion for test in self.tests)
        return ', '.join(f'{one} {counts[one]}' for one in CONCLUSIONS if counts[one])


def check_claims(results: Results, name: str = '') -> Dict[str, List[ClaimResult]]:
    """Test all claims for each set of varied parameters; the keys are those of `compare_with_paper`."""
    found = {}
    parameters = [varied_texts(values, results.varied) for values in results.trials[results.varied].values.tolist()]
    campaigns = [', '.join(filter(None, [name, *texts])) for texts in parameters]
    for campaign, trials in results.trials.groupby(np.array(campaigns), sort=False):
        tested = [(claim, CLAIMS[claim['key']](trials)) for claim in load_claims()]
        found[campaign] = [
            ClaimResult(one['text'], one['where'], claim_conclusion(tests), tests) for one, tests in tested
        ]
    return found


def claim_conclusion(tests: Sequence[HypothesisTest]) -> str:
    """Return the conclusion: one failed part contradicts a claim; all parts must hold to reproduce it."""
    conclusions = [test.conclusion for test in tests]
    if FAILS in conclusions:
        return 'contradicted'
    if conclusions and all(one == HOLDS for one in conclusions):
        return 'reproduced'
    return 'not contradicted' if any(test.p_against is not None for test in tests) else 'not tested: too few trials'
