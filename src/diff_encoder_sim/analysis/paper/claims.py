"""The paper's claims in our own words, and the hypothesis tests of their parts on our trials.

A claim has many parts (tests, encoders, quantities) and holds when all of them do, for which 95 % in each are enough.
It fails when one of them does; that this is not chance is kept at 95 % for all parts together, by Holm.
"""

from __future__ import annotations

import enum
import itertools
import math
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.paper.paper_cells import PPRS, TRIALS
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

ODOM, GLOBAL, WORLD = 'odom', 'global', 'world'

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = [(coarse, fine) for coarse in COARSE for fine in FINE]
EXTREMES = [(PPRS[0], PPRS[-1])]

# 30 of 30 trials in both cells bound the difference by 9 percentage points, no closer.
EQUAL_FRACTIONS_MARGIN = 0.15

# Fewer pairs have no test of their spreads.
FEWEST_PAIRS = 3

# A smaller difference is negligible, as a fraction of the tolerance.
NEGLIGIBLE_FRACTION = 0.1

# Smaller p-values are shown as smaller than this.
SMALLEST_P = 1e-4


class Conclusion(enum.Enum):
    """What a hypothesis test shows."""

    HOLDS = 'holds'
    FAILS = 'fails'
    UNCLEAR = 'unclear'


class HypothesisTest(NamedTuple):
    """The test of one part of a claim."""

    conclusion: Conclusion
    text: str  # with the numbers
    p_against: Optional[float] = None  # corrected for the number of parts; None without enough trials


class Sample(NamedTuple):
    """The errors of a pose source in one cell."""

    label: str  # as the report shows it
    values: np.ndarray  # (n,) in the quantity's unit
    quantity: Quantity


class Pair(NamedTuple):
    """Errors of equal trials, which are compared in pairs."""

    label: str  # as the report shows it
    names: Tuple[str, str]
    values: Tuple[np.ndarray, np.ndarray]  # (n,) each, in the quantity's unit
    quantity: Quantity


# A part of a claim, tested alone: its text with the numbers, whether it holds with 95 % confidence, and the p-value of
# the part being true, which is 1 if our trials are on the claim's side.
_Part = Tuple[str, bool, float]


def _concluded(too_few: Iterable[str], parts: Sequence[_Part]) -> List[HypothesisTest]:
    """Conclude from all parts of a claim, corrected for their number; first come the labels of those without a test."""
    tests = [HypothesisTest(Conclusion.UNCLEAR, f'{label}: too few trials') for label in too_few]
    for (text, holds, _), p_value in zip(parts, holm([p_against for _, _, p_against in parts])):
        unless_fails = Conclusion.HOLDS if holds else Conclusion.UNCLEAR
        tests.append(HypothesisTest(Conclusion.FAILS if p_value < SIGNIFICANCE else unless_fails, text, p_value))
    return tests


# Samples against a limit, which is taken as printed: it is no sample.


def fractions_within(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the fractions within tolerance are above, or below, `limit`, by the score test of Wilson's interval."""

    def measured(one: Sample) -> Tuple[str, float, float]:
        within, trials = _count_within(one.values, one.quantity), len(one.values)
        low, high = wilson(within, trials, LEVEL)
        deviation = (within / trials - limit) / math.sqrt(limit * (1.0 - limit) / trials)
        text = f'{one.label}: {within} of {trials} within, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %'
        return text, within / trials, 2.0 * float(stats.norm.sf(abs(deviation)))

    return _against_limit(measured, limit, above, below, 1)


def spreads(limit: float, above: Sequence[Sample] = (), below: Sequence[Sample] = ()) -> List[HypothesisTest]:
    """Test that the standard deviations are above, or below, `limit`, by chi-square."""

    def measured(one: Sample) -> Tuple[str, float, float]:
        std, freedom, (low, high) = spread(one.values) or 0.0, len(one.values) - 1, std_interval(one.values, LEVEL)
        squares = freedom * (std / limit) ** 2
        p_value = 2.0 * float(min(stats.chi2.cdf(squares, freedom), stats.chi2.sf(squares, freedom)))
        interval = f'95 % interval {low:.3g} to {high:.3g}'
        return f'{one.label}: standard deviation {std:.3g} {one.quantity.unit}, {interval}', std, p_value

    return _against_limit(measured, limit, above, below, 2)


def _against_limit(
    measured: Callable[[Sample], Tuple[str, float, float]],
    limit: float,
    above: Sequence[Sample],
    below: Sequence[Sample],
    fewest: int,
) -> List[HypothesisTest]:
    """Test each sample that has at least `fewest` values by its text, value and two-sided p-value of the limit."""
    parts = []
    for one, is_above in [*((one, True) for one in above), *((one, False) for one in below)]:
        if len(one.values) >= fewest:
            text, value, p_value = measured(one)
            is_as_claimed = value > limit if is_above else value < limit
            parts.append((text, is_as_claimed and p_value < SIGNIFICANCE, 1.0 if is_as_claimed else p_value))
    return _concluded((one.label for one in [*above, *below] if len(one.values) < fewest), parts)


# Pairs of errors of equal trials.


def first_spreads_more(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger standard deviation, by the ratio's jackknife."""
    return _first_is_larger(
        pairs,
        'standard deviation',
        lambda values: spread(values) or 0.0,
        lambda first, second: spread_ratio(first, second).p_value,
    )


def first_errs_more(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the first of each pair has the larger absolute errors, by Wilcoxon's signed-rank test."""
    return _first_is_larger(
        pairs,
        'median absolute error',
        lambda values: float(np.median(np.abs(values))),
        lambda first, second: wilcoxon(np.abs(first), np.abs(second)).p_value,
    )


def _first_is_larger(
    pairs: Sequence[Pair],
    what: str,
    size: Callable[[np.ndarray], float],
    p_value_of: Callable[[np.ndarray, np.ndarray], float],
) -> List[HypothesisTest]:
    parts = []
    for pair in pairs:
        if len(pair.values[0]) >= FEWEST_PAIRS:
            (first, second), p_value, unit = map(size, pair.values), p_value_of(*pair.values), pair.quantity.unit
            both = f'{first:.3g} {unit} ({pair.names[0]}), {second:.3g} {unit} ({pair.names[1]})'
            is_larger = first > second
            text = f'{pair.label}: {what} {both}, p {p_value:.2g}'
            parts.append((text, is_larger and p_value < SIGNIFICANCE, 1.0 if is_larger else p_value))
    return _concluded((pair.label for pair in pairs if len(pair.values[0]) < FEWEST_PAIRS), parts)


def fractions_equal(pairs: Sequence[Pair]) -> List[HypothesisTest]:
    """Test that the fractions within tolerance differ by less than EQUAL_FRACTIONS_MARGIN, by McNemar's test."""
    parts = []
    for pair in pairs:
        if len(pair.values[0]):
            is_first, is_second = (np.abs(values) <= pair.quantity.tolerance for values in pair.values)
            result = mcnemar(is_first, is_second, LEVEL)
            is_equal = max(-result.interval.low, result.interval.high) < EQUAL_FRACTIONS_MARGIN
            first, second = (_count_within(values, pair.quantity) for values in pair.values)
            counts = f'within tolerance {first} ({pair.names[0]}) and {second} ({pair.names[1]}) of {result.pairs}'
            parts.append((f'{pair.label}: {counts}', is_equal, 1.0 if is_equal else result.p_value))
    return _concluded((pair.label for pair in pairs if not len(pair.values[0])), parts)


# Claims about every trial. The paper's 30 of 30 trials are a sample: 29 of 30 of ours are no evidence against it
# (Fisher's exact test, p = 1). All cells together are tested too, since a few trials in each may be many. If trials of
# several cells have common noise, that p-value is too small or too large by a little; each cell's is not.


def all_succeeded(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test that every trial reached its goal."""
    is_true = {cell: of_cell['outcome'] == SUCCEEDED for cell, of_cell in trials.groupby(['test', 'ppr'], sort=False)}
    return _every_trial('reached the goal', is_true)


def all_within(trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str]) -> List[HypothesisTest]:
    """Test that every trial ends within tolerance in x and in y."""
    cells = itertools.product(tests, pprs)
    return _every_trial('within', {cell: are_within(_of_cell(trials, *cell), pose, (X, Y)) for cell in cells})


def amcl_matches_global(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test that the final /amcl_pose and /global_pose agree to a tenth of the tolerance, in every trial."""
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
    """Compare each cell's count, and that of all, with as many of the paper's trials, all of them true.

    Args:
        what: is claimed.
        is_true: of each trial, by test and PPR.
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
        parts.append((f'{label}: {compared}, p {p_value:.2g}', true_ours == trials, float(p_value)))
    return _concluded((label for label, each in labelled.items() if not len(each)), parts)


# The errors that a part of a claim is about.


def _of_cell(trials: pd.DataFrame, test: str, ppr: str) -> pd.DataFrame:
    return trials[(trials['test'] == test) & (trials['ppr'] == ppr)]


def _count_within(values: np.ndarray, quantity: Quantity) -> int:
    return int(np.sum(np.abs(values) <= quantity.tolerance))


def samples(
    trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str], quantities: Sequence[Quantity]
) -> List[Sample]:
    """Return a sample for each cell and quantity; it is empty if there is no such cell."""
    return [
        Sample(
            f'{POSES[pose]} in {test} at {ppr} PPR, {quantity.axis}',
            final_errors(_of_cell(trials, test, ppr), pose, quantity),
            quantity,
        )
        for test, ppr, quantity in itertools.product(tests, pprs, quantities)
    ]


def pairs_of_pprs(
    trials: pd.DataFrame,
    pose: str,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]],
    quantities: Sequence[Quantity],
) -> List[Pair]:
    """Pair equal trials with two encoders; a pair is empty if one of them is missing."""
    pairs = []
    for test, (first, second) in itertools.product(tests, pprs):
        one, other = equal_trials(_of_cell(trials, test, first), _of_cell(trials, test, second), pose)
        for quantity in quantities:
            values = final_errors(one, pose, quantity), final_errors(other, pose, quantity)
            label = f'{POSES[pose]} in {test}, {quantity.axis}'
            pairs.append(Pair(label, (f'{first} PPR', f'{second} PPR'), values, quantity))
    return pairs


def pairs_of_y_and_x(trials: pd.DataFrame, pose: str, tests: Sequence[str], pprs: Sequence[str]) -> List[Pair]:
    """Pair both errors of position of each trial."""
    pairs = []
    for test, ppr in itertools.product(tests, pprs):
        values = [final_errors(_of_cell(trials, test, ppr), pose, axis) for axis in (Y, X)]
        pairs.append(Pair(f'{POSES[pose]} in {test} at {ppr} PPR', ('y', 'x'), (values[0], values[1]), X))
    return pairs


class Claim(NamedTuple):
    """A statement of the paper about its results."""

    text: str
    where: str  # in the paper
    test: Callable[[pd.DataFrame], List[HypothesisTest]]  # a hypothesis test for each part


def _heading_by_resolution(trials: pd.DataFrame) -> List[HypothesisTest]:
    """Test the heading over all tests, as the claim does, in all three tables: it does not name one."""
    of_tests = trials[trials['test'].isin(STANDARD_TESTS)]
    above, below = (
        [
            Sample(
                f'{POSES[pose]} at {ppr} PPR, {YAW.axis}',
                final_errors(of_tests[of_tests['ppr'] == ppr], pose, YAW),
                YAW,
            )
            for pose, ppr in itertools.product((ODOM, GLOBAL, WORLD), pprs)
        ]
        for pprs in (FINE, COARSE)
    )
    return fractions_within(0.9, above, below)


CLAIMS: Tuple[Claim, ...] = (
    Claim('The robot completes every route.', 'sections III and IV', all_succeeded),
    Claim(
        'The heading of odometry after the straight line spreads by less than the tolerance of '
        '3 degrees, with every encoder.',
        'section III, table 4',
        lambda trials: spreads(YAW.tolerance, below=samples(trials, ODOM, ['SL'], PPRS, [YAW])),
    ),
    Claim(
        'In turns in place, odometry with 1024 and 4096 PPR spreads less than with 40 and 90.',
        'section III, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, ['SMT'], COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A higher resolution gives steadier odometry: 1024 and 4096 PPR spread less than 40 and 90 in every test.',
        'sections III and IV, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, STANDARD_TESTS, COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A low resolution drifts: after the long drive the position error of odometry is larger '
        'with 40 PPR than with 4096.',
        'abstract, section IV',
        lambda trials: first_errs_more(pairs_of_pprs(trials, ODOM, ['DLD'], EXTREMES, [X, Y])),
    ),
    Claim(
        'The true final position spreads more about the goal with 40 PPR than with 4096.',
        'section III, figure 4, table 5',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, WORLD, STANDARD_TESTS, EXTREMES, [X, Y])),
    ),
    Claim(
        'The error across the drive (y) varies more than that along it (x).',
        'section III, figure 4',
        lambda trials: first_spreads_more(
            [pair for source in (ODOM, WORLD) for pair in pairs_of_y_and_x(trials, source, ['SL', 'DLD'], PPRS)]
        ),
    ),
    Claim(
        'Odometry is poor in the long drive: position spreads by more than 0.05 m with every encoder.',
        'section III, table 4',
        lambda trials: spreads(0.05, above=samples(trials, ODOM, ['DLD'], PPRS, [X, Y])),
    ),
    Claim(
        'Odometry is within 0.05 m in at most 20 per cent of the long drives, with any encoder.',
        'section III, table 4',
        lambda trials: fractions_within(0.2, below=samples(trials, ODOM, ['DLD'], PPRS, [X, Y])),
    ),
    Claim(
        'By AMCL (/global_pose) every trial ends within 0.05 m in x and in y, with every encoder.',
        'section III, table 6',
        lambda trials: all_within(trials, GLOBAL, STANDARD_TESTS, PPRS),
    ),
    Claim(
        'The true position ends within 0.05 m in 85 to 100 per cent of the trials.',
        'section III, table 5',
        lambda trials: fractions_within(0.85, above=samples(trials, WORLD, STANDARD_TESTS, PPRS, [X, Y])),
    ),
    Claim(
        'The heading is within 3 degrees in less than 90 per cent of the trials with 40 and 90 '
        'PPR, in more than 90 per cent with 1024 and 4096.',
        'section III',
        _heading_by_resolution,
    ),
    Claim(
        'The resolution matters for the heading in the long drive: the true heading spreads more with '
        '40 PPR than with 4096.',
        'section III, table 5',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, WORLD, ['DLD'], EXTREMES, [YAW])),
    ),
    Claim(
        'The position by AMCL hardly depends on the resolution: within tolerance as often with 40 PPR as with 4096.',
        'section IV, table 6',
        lambda trials: fractions_equal(pairs_of_pprs(trials, GLOBAL, STANDARD_TESTS, EXTREMES, [X, Y])),
    ),
    Claim(
        '/amcl_pose and /global_pose agree but for negligible differences.',
        'section III, figure 4',
        amcl_matches_global,
    ),
)


class ClaimResult(NamedTuple):
    """A claim and what our trials show."""

    text: str
    where: str  # in the paper
    conclusion: str
    tests: List[HypothesisTest]

    @property
    def p_text(self) -> str:
        """Return the p-value of the part that speaks most against the claim; empty if none was tested."""
        p_value = min((test.p_against for test in self.tests if test.p_against is not None), default=None)
        return '' if p_value is None else f'p {p_value:.2g}' if p_value >= SMALLEST_P else f'p < {SMALLEST_P:g}'

    @property
    def counts(self) -> str:
        """Count the parts of the claim by their conclusions."""
        counts = {conclusion: sum(test.conclusion is conclusion for test in self.tests) for conclusion in Conclusion}
        return ', '.join(f'{conclusion.value} {count}' for conclusion, count in counts.items() if count)


def check_claims(results: Results, name: str = '') -> Dict[str, List[ClaimResult]]:
    """Test every claim, for each set of varied parameters; by `name` with these, as `compare_with_paper` does."""
    found = {}
    parameters = [varied_texts(values, results.varied) for values in results.trials[results.varied].values.tolist()]
    campaigns = [', '.join(filter(None, [name, *texts])) for texts in parameters]
    for campaign, trials in results.trials.groupby(np.array(campaigns), sort=False):
        tested = [(claim, claim.test(trials)) for claim in CLAIMS]
        found[campaign] = [ClaimResult(one.text, one.where, claim_conclusion(tests), tests) for one, tests in tested]
    return found


def claim_conclusion(tests: Sequence[HypothesisTest]) -> str:
    """Conclude from the parts: one that fails contradicts a claim, all must hold to reproduce it."""
    conclusions = [test.conclusion for test in tests]
    if Conclusion.FAILS in conclusions:
        return 'contradicted'
    if conclusions and all(one is Conclusion.HOLDS for one in conclusions):
        return 'reproduced'
    return 'not contradicted' if any(test.p_against is not None for test in tests) else 'not tested: too few trials'
