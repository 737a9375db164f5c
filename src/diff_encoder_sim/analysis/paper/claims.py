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

from diff_encoder_sim.analysis import results_table, statistics
from diff_encoder_sim.analysis.paper.paper_cells import PPRS, TRIALS, load_claims
from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES, YAW, Quantity, X, Y
from diff_encoder_sim.analysis.results_table import STANDARD_TESTS, SUCCEEDED, Results, final_errors
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.se2 import wrap_angles

stats = deferred('scipy.stats')

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = list(itertools.product(COARSE, FINE))
EXTREMES = [(PPRS[0], PPRS[-1])]
_TABLES = ('odom', 'global', 'world')

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
    sign: int = 1  # 1: claimed above a limit; -1: below

    def count_within(self) -> List[int]:
        """Return the number of values within tolerance per sample."""
        return [int(np.sum(np.abs(values) <= self.quantity.tolerance)) for values in self.values]


# Result of a part before correction: text with the numbers, whether it is as claimed, whether this is significant, and
# the p-value against the part if it is not as claimed.
_Judged = Tuple[str, bool, bool, float]


def judged_parts(parts: Sequence[Errors], judge: Callable[[Errors], _Judged], fewest: int = 1) -> List[HypothesisTest]:
    """Test all parts of a claim that have at least `fewest` values; the others come first."""
    enough = [judge(part) for part in parts if len(part.values[0]) >= fewest]
    return _concluded([part.label for part in parts if len(part.values[0]) < fewest], enough)


def _concluded(too_few: Sequence[str], parts: Sequence[_Judged]) -> List[HypothesisTest]:
    tests = [HypothesisTest(UNCLEAR, f'{label}: too few trials') for label in too_few]
    adjusted = statistics.holm([1.0 if is_as_claimed else p_value for _, is_as_claimed, _, p_value in parts])
    for (text, is_as_claimed, is_sure, _), p_value in zip(parts, adjusted):
        conclusion = HOLDS if is_as_claimed and is_sure else UNCLEAR
        tests.append(HypothesisTest(FAILS if p_value < statistics.SIGNIFICANCE else conclusion, text, p_value))
    return tests


def fractions_within(limit: float, parts: Sequence[Errors]) -> List[HypothesisTest]:
    """Test the fractions within tolerance against a printed limit, by the score test of Wilson's interval."""

    def judge(one: Errors) -> _Judged:
        [within], trials = one.count_within(), len(one.values[0])
        low, high = statistics.wilson(within, trials)
        deviation = (within / trials - limit) / math.sqrt(limit * (1.0 - limit) / trials)
        text = f'{one.label}: {within} of {trials} within, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %'
        p_value = 2.0 * float(stats.norm.sf(abs(deviation)))
        return text, one.sign * (within / trials - limit) > 0.0, p_value < statistics.SIGNIFICANCE, p_value

    return judged_parts(parts, judge)


def spreads(limit: float, parts: Sequence[Errors]) -> List[HypothesisTest]:
    """Test the standard deviations against a limit, by chi-square."""

    def judge(one: Errors) -> _Judged:
        std, freedom = statistics.spread(one.values[0]) or 0.0, len(one.values[0]) - 1
        low, high = statistics.std_interval(one.values[0])
        squares = freedom * (std / limit) ** 2
        p_value = 2.0 * float(min(stats.chi2.cdf(squares, freedom), stats.chi2.sf(squares, freedom)))
        text = f'{one.label}: standard deviation {std:.3g} {one.quantity.unit}, 95 % interval {low:.3g} to {high:.3g}'
        return text, one.sign * (std - limit) > 0.0, p_value < statistics.SIGNIFICANCE, p_value

    return judged_parts(parts, judge, 2)


def first_spreads_more(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger standard deviation, by the ratio's jackknife."""
    return _larger_first(pairs, 'standard deviation', statistics.spread, statistics.spread_ratio)


def first_errs_more(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger absolute errors, by Wilcoxon's signed-rank test."""
    sizes = [pair._replace(values=tuple(map(np.abs, pair.values))) for pair in pairs]
    return _larger_first(sizes, 'median absolute error', np.median, statistics.wilcoxon)


def _larger_first(
    pairs: Sequence[Errors], what: str, measure: Callable[[np.ndarray], Any], compare: Callable[..., Any]
) -> List[HypothesisTest]:
    def judge(pair: Errors) -> _Judged:
        first, second = sizes = [float(measure(values) or 0.0) for values in pair.values]
        p_value = compare(*pair.values).p_value
        both = ', '.join(f'{size:.3g} {pair.quantity.unit} ({name})' for size, name in zip(sizes, pair.names))
        return (
            f'{pair.label}: {what} {both}, p {p_value:.2g}',
            first > second,
            p_value < statistics.SIGNIFICANCE,
            p_value,
        )

    return judged_parts(pairs, judge, FEWEST_PAIRS)


def fractions_equal(pairs: Sequence[Errors]) -> List[HypothesisTest]:
    """Test that the fractions within tolerance differ by less than EQUAL_FRACTIONS_MARGIN, by McNemar's test."""

    def judge(pair: Errors) -> _Judged:
        result = statistics.mcnemar(*(np.abs(values) <= pair.quantity.tolerance for values in pair.values))
        is_equal = max(-result.interval.low, result.interval.high) < EQUAL_FRACTIONS_MARGIN
        counts = ' and '.join(f'{count} ({name})' for count, name in zip(pair.count_within(), pair.names))
        return f'{pair.label}: within tolerance {counts} of {result.pairs}', is_equal, is_equal, result.p_value

    return judged_parts(pairs, judge)


def every_trial(
    what: str,
    trials: pd.DataFrame,
    is_true: Callable[[pd.DataFrame], Any],
    cells: Optional[Sequence[Tuple[str, str]]] = None,
) -> List[HypothesisTest]:
    """Compare the counts per cell and in total with those of the paper, where all trials succeeded.

    The paper's 30 of 30 trials are a sample: 29 of 30 of ours do not contradict it (Fisher's exact test, p = 1). The
    total is also tested because a few failures per cell add up. If cells have common noise, its p-value is approximate.

    Args:
        what: the claimed property.
        trials: all trials.
        is_true: returns whether each trial of a cell has the property.
        cells: test and PPR; those of the trials by default.
    """
    cells = cells or list(trials[['test', 'ppr']].drop_duplicates().itertuples(index=False, name=None))
    labelled = {f'{test} at {ppr} PPR': is_true(_of_cell(trials, test, ppr)) for test, ppr in cells}
    counts = [(label, int(sum(each)), len(each), TRIALS) for label, each in labelled.items() if len(each)]
    if len(counts) > 1:
        counts.append(('all cells', *np.sum([numbers for _, *numbers in counts], axis=0).tolist()))
    parts = []
    for label, true_ours, ours, theirs in counts:
        _, p_value = stats.fisher_exact(np.array([[true_ours, ours - true_ours], [theirs, 0]]))
        text = f'{label}: {true_ours} of {ours} {what}, the paper {theirs} of {theirs}, p {p_value:.2g}'
        parts.append((text, true_ours == ours, True, float(p_value)))  # if all are true, the p-value is 1
    return _concluded([label for label, each in labelled.items() if not len(each)], parts)


def _agree(trials: pd.DataFrame) -> np.ndarray:
    """Return whether the final /amcl_pose and /global_pose agree within a tenth of the tolerance."""
    known, parts = trials.dropna(subset=['amcl_x_m', 'global_x_m']), []
    for quantity in QUANTITIES:
        difference = known[quantity.column('amcl')] - known[quantity.column('global')]
        difference = wrap_angles(difference) if quantity is YAW else difference
        parts.append(quantity.scale * np.abs(difference) <= NEGLIGIBLE_FRACTION * quantity.tolerance)
    every: np.ndarray = np.all(parts, axis=0)
    return every


def _of_cell(trials: pd.DataFrame, test: str, ppr: str) -> pd.DataFrame:
    return trials[(trials['test'] == test) & (trials['ppr'] == ppr)]


def samples(
    trials: pd.DataFrame,
    pose: str,
    tests: Sequence[str],
    pprs: Sequence[str] = PPRS,
    quantities: Sequence[Quantity] = (X, Y),
    sign: int = 1,
) -> List[Errors]:
    """Return a sample per cell and quantity; empty if there is no such cell."""
    parts = []
    for test, ppr, quantity in itertools.product(tests, pprs, quantities):
        values = final_errors(_of_cell(trials, test, ppr), pose, quantity)
        parts.append(Errors(f'{POSES[pose]} in {test} at {ppr} PPR, {quantity.axis}', quantity, (values,), sign=sign))
    return parts


def pairs_of_pprs(
    trials: pd.DataFrame,
    pose: str,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]] = EXTREMES,
    quantities: Sequence[Quantity] = (X, Y),
) -> List[Errors]:
    """Pair equal trials with two encoders; empty if an encoder is missing."""
    pairs = []
    for test, (first, second) in itertools.product(tests, pprs):
        both = results_table.equal_trials(_of_cell(trials, test, first), _of_cell(trials, test, second), pose)
        for quantity in quantities:
            values = tuple(final_errors(one, pose, quantity) for one in both)
            label = f'{POSES[pose]} in {test}, {quantity.axis}'
            pairs.append(Errors(label, quantity, values, (f'{first} PPR', f'{second} PPR')))
    return pairs


def pairs_of_y_and_x(trials: pd.DataFrame, poses: Sequence[str], tests: Sequence[str]) -> List[Errors]:
    """Pair the y and x errors of each trial."""
    pairs = []
    for pose, test, ppr in itertools.product(poses, tests, PPRS):
        values = tuple(final_errors(_of_cell(trials, test, ppr), pose, axis) for axis in (Y, X))
        pairs.append(Errors(f'{POSES[pose]} in {test} at {ppr} PPR', X, values, ('y', 'x')))
    return pairs


def headings(trials: pd.DataFrame) -> List[Errors]:
    """Return the headings over all tests and in all three tables, because the claim does not name any."""
    of_tests, parts = trials[trials['test'].isin(STANDARD_TESTS)], []
    for pose, ppr in [*itertools.product(_TABLES, FINE), *itertools.product(_TABLES, COARSE)]:
        values, sign = (final_errors(of_tests[of_tests['ppr'] == ppr], pose, YAW),), 1 if ppr in FINE else -1
        parts.append(Errors(f'{POSES[pose]} at {ppr} PPR, {YAW.axis}', YAW, values, sign=sign))
    return parts


# Hypothesis tests of each claim of config/paper/claims.csv.
CLAIMS: Dict[str, Callable[[pd.DataFrame], List[HypothesisTest]]] = {
    'routes': lambda trials: every_trial('reached the goal', trials, lambda part: part['outcome'] == SUCCEEDED),
    'straight_heading': lambda trials: spreads(YAW.tolerance, samples(trials, 'odom', ['SL'], PPRS, [YAW], -1)),
    'turns': lambda trials: first_spreads_more(pairs_of_pprs(trials, 'odom', ['SMT'], COARSE_AND_FINE, QUANTITIES)),
    'steadier': lambda trials: first_spreads_more(
        pairs_of_pprs(trials, 'odom', STANDARD_TESTS, COARSE_AND_FINE, QUANTITIES)
    ),
    'drift': lambda trials: first_errs_more(pairs_of_pprs(trials, 'odom', ['DLD'])),
    'true_position': lambda trials: first_spreads_more(pairs_of_pprs(trials, 'world', STANDARD_TESTS)),
    'across': lambda trials: first_spreads_more(pairs_of_y_and_x(trials, ['odom', 'world'], ['SL', 'DLD'])),
    'long_drive_spread': lambda trials: spreads(0.05, samples(trials, 'odom', ['DLD'])),
    'long_drive_within': lambda trials: fractions_within(0.2, samples(trials, 'odom', ['DLD'], sign=-1)),
    'amcl_within': lambda trials: every_trial(
        'within',
        trials,
        lambda part: results_table.are_within(part, 'global', (X, Y)),
        list(itertools.product(STANDARD_TESTS, PPRS)),
    ),
    'true_within': lambda trials: fractions_within(0.85, samples(trials, 'world', STANDARD_TESTS)),
    'heading': lambda trials: fractions_within(0.9, headings(trials)),
    'true_heading': lambda trials: first_spreads_more(pairs_of_pprs(trials, 'world', ['DLD'], quantities=[YAW])),
    'amcl_resolution': lambda trials: fractions_equal(pairs_of_pprs(trials, 'global', STANDARD_TESTS)),
    'amcl_global': lambda trials: every_trial('agree', trials, _agree),
}


class ClaimResult(NamedTuple):
    """Claim with the results of its tests."""

    text: str
    where: str  # in the paper
    tests: List[HypothesisTest]

    @property
    def conclusion(self) -> str:
        """Return the conclusion: one failed part contradicts a claim; all parts must hold to reproduce it."""
        conclusions = {test.conclusion for test in self.tests}
        if FAILS in conclusions or conclusions == {HOLDS}:
            return 'contradicted' if FAILS in conclusions else 'reproduced'
        return 'not contradicted' if self.p_text else 'not tested: too few trials'

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
    campaigns = results.trials.groupby(np.array(results_table.campaign_names(results, name)), sort=False)
    return {
        campaign: [ClaimResult(one['text'], one['where'], CLAIMS[one['key']](trials)) for one in load_claims()]
        for campaign, trials in campaigns
    }
