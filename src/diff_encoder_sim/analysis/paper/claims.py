"""Hypothesis tests of the paper's claims on our trials.

A claim has several parts (tests, encoders, quantities). It holds if all parts hold, each with 95 % confidence. It fails
if one part fails, with 95 % confidence over all parts (Holm).
"""

from __future__ import annotations

import functools
import itertools
import math
from collections import Counter
from typing import Any, Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis import statistics
from diff_encoder_sim.analysis.paper.comparison import PPRS, TRIALS, paper_table
from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES, YAW, Quantity, X, Y
from diff_encoder_sim.analysis.results_table import STANDARD_TESTS, SUCCEEDED, are_within, equal_trials, final_errors
from diff_encoder_sim.analysis.statistics import PairedResult
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


class Part(NamedTuple):
    """Hypothesis test of one part of a claim."""

    text: str  # with the numbers
    is_as_claimed: bool = False
    p_value: float = math.nan  # against the part if it is not as claimed; NaN without enough trials
    is_significant: bool = False  # if it is as claimed
    conclusion: str = UNCLEAR  # of CONCLUSIONS, when the p-value is corrected for the number of parts


class Sample(NamedTuple):
    """Errors of one cell, or of pairs of equal trials."""

    label: str  # in the report
    quantity: Quantity
    values: Tuple[np.ndarray, ...]  # one or two of (n,), in the quantity's unit
    names: Tuple[str, ...] = ()  # of the two of pairs

    def are_within(self) -> List[np.ndarray]:
        """Return whether the errors are within tolerance."""
        return [np.abs(values) <= self.quantity.tolerance for values in self.values]

    def part(self, numbers: str, is_as_claimed: bool, p_value: float) -> Part:
        """Return a part of a claim about these errors."""
        return Part(f'{self.label}: {numbers}', is_as_claimed, p_value, p_value < statistics.SIGNIFICANCE)


def concluded(parts: Iterable[Part]) -> List[Part]:
    """Conclude on the parts of one claim, with corrected p-values; those without enough trials come first."""
    parts = list(parts)
    tests = [part for part in parts if math.isnan(part.p_value)]
    tested = [part for part in parts if not math.isnan(part.p_value)]
    adjusted = statistics.holm([1.0 if part.is_as_claimed else part.p_value for part in tested])
    for part, p_value in zip(tested, adjusted):
        conclusion = HOLDS if part.is_as_claimed and part.is_significant else UNCLEAR
        conclusion = FAILS if p_value < statistics.SIGNIFICANCE else conclusion
        tests.append(part._replace(conclusion=conclusion, p_value=p_value))
    return tests


def fraction_within(sample: Sample, limit: float, sign: int = 1) -> Part:
    """Test a fraction within tolerance, claimed above (sign 1) or below (-1) a limit, by the score test of Wilson."""
    [is_within] = sample.are_within()
    within, trials = int(is_within.sum()), len(is_within)
    if not trials:
        return Part(f'{sample.label}: too few trials')
    low, high = statistics.wilson(within, trials)
    deviation = (within / trials - limit) / math.sqrt(limit * (1.0 - limit) / trials)
    text = f'{within} of {trials} within, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %'
    return sample.part(text, sign * deviation > 0.0, 2.0 * float(stats.norm.sf(abs(deviation))))


def spread(sample: Sample, limit: float, sign: int = 1) -> Part:
    """Test a standard deviation, claimed above (sign 1) or below (-1) a limit, by chi-square."""
    [values] = sample.values
    if len(values) < 2:
        return Part(f'{sample.label}: too few trials')
    std, freedom, (low, high) = statistics.spread(values) or 0.0, len(values) - 1, statistics.std_interval(values)
    squares = freedom * (std / limit) ** 2
    p_value = 2.0 * float(min(stats.chi2.cdf(squares, freedom), stats.chi2.sf(squares, freedom)))
    text = f'standard deviation {std:.3g} {sample.quantity.unit}, 95 % interval {low:.3g} to {high:.3g}'
    return sample.part(text, sign * (std - limit) > 0.0, p_value)


# Properties that the first of a pair is claimed to have larger: name, estimate and significance test.
Property = Tuple[str, Callable[[np.ndarray], Any], Callable[..., PairedResult]]
SPREAD: Property = ('standard deviation', statistics.spread, statistics.spread_ratio)
SIZE: Property = ('median absolute error', np.median, statistics.wilcoxon)


def first_is_larger(pair: Sample, compared: Property = SPREAD) -> Part:
    """Test that the first of a pair has the larger standard deviation (jackknife), or size of errors (Wilcoxon)."""
    if len(pair.values[0]) < FEWEST_PAIRS:
        return Part(f'{pair.label}: too few trials')
    name, estimate, test = compared
    values = [np.abs(each) if compared is SIZE else each for each in pair.values]
    first, second = sizes = [float(estimate(each) or 0.0) for each in values]
    p_value = test(*values).p_value
    both = ', '.join(f'{size:.3g} {pair.quantity.unit} ({whose})' for size, whose in zip(sizes, pair.names))
    return pair.part(f'{name} {both}, p {p_value:.2g}', first > second, p_value)


def fractions_equal(pair: Sample) -> Part:
    """Test that the fractions within tolerance differ by less than EQUAL_FRACTIONS_MARGIN, by McNemar's test."""
    are_within = pair.are_within()
    count, _, interval, p_value = statistics.mcnemar(*are_within)
    if not count:
        return Part(f'{pair.label}: too few trials')
    is_equal = max(-interval.low, interval.high) < EQUAL_FRACTIONS_MARGIN
    counts = ' and '.join(f'{each.sum()} ({name})' for each, name in zip(are_within, pair.names))
    return Part(f'{pair.label}: within tolerance {counts} of {count}', is_equal, p_value, is_significant=is_equal)


def every_trial(
    what: str,
    trials: pd.DataFrame,
    is_true: Callable[[pd.DataFrame], Any],
    cells: Optional[Sequence[Tuple[str, str]]] = None,
) -> List[Part]:
    """Compare the counts per cell and in total with those of the paper, where all trials succeeded.

    The paper's 30 of 30 trials are a sample: 29 of 30 of ours do not contradict it (Fisher's exact test, p = 1). The
    total is also tested because a few failures per cell add up. If cells have common noise, its p-value is approximate.
    The cells are pairs of test and PPR, by default those of the trials.
    """
    cells = cells or list(trials[['test', 'ppr']].drop_duplicates().itertuples(index=False, name=None))
    labelled = {f'{test} at {ppr} PPR': is_true(_of_cell(trials, test, ppr)) for test, ppr in cells}
    parts = [Part(f'{label}: too few trials') for label, each in labelled.items() if not len(each)]
    counts = [(label, int(sum(each)), len(each), TRIALS) for label, each in labelled.items() if len(each)]
    if len(counts) > 1:
        counts.append(('all cells', *np.sum([numbers for _, *numbers in counts], axis=0).tolist()))
    for label, true_ours, ours, theirs in counts:
        _, p_value = stats.fisher_exact(np.array([[true_ours, ours - true_ours], [theirs, 0]]))
        text = f'{label}: {true_ours} of {ours} {what}, the paper {theirs} of {theirs}, p {p_value:.2g}'
        parts.append(Part(text, true_ours == ours, float(p_value), is_significant=True))  # if all are true, p is 1
    return parts


def _agree(trials: pd.DataFrame) -> np.ndarray:
    """Return whether the final /amcl_pose and /global_pose agree within a tenth of the tolerance."""
    known, parts = trials.dropna(subset=['amcl_x_m', 'global_x_m']), []
    for quantity in QUANTITIES:
        difference = known[quantity.column('amcl')] - known[quantity.column('global')]
        difference = wrap_angles(difference) if quantity is YAW else difference
        parts.append(quantity.scale * np.abs(difference) <= NEGLIGIBLE_FRACTION * quantity.tolerance)
    return np.asarray(np.all(parts, axis=0))


def _of_cell(trials: pd.DataFrame, test: str, ppr: str) -> pd.DataFrame:
    return trials[(trials['test'] == test) & (trials['ppr'] == ppr)]


def samples(
    trials: pd.DataFrame, pose: str, tests: Sequence[str], quantities: Sequence[Quantity] = (X, Y)
) -> Iterator[Sample]:
    """Yield a sample per cell and quantity; empty if there is no such cell."""
    for test, ppr, quantity in itertools.product(tests, PPRS, quantities):
        values = final_errors(_of_cell(trials, test, ppr), pose, quantity)
        yield Sample(f'{POSES[pose]} in {test} at {ppr} PPR, {quantity.axis}', quantity, (values,))


def pairs_of_pprs(
    trials: pd.DataFrame,
    pose: str,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]] = EXTREMES,
    quantities: Sequence[Quantity] = (X, Y),
) -> Iterator[Sample]:
    """Pair equal trials with two encoders; empty if an encoder is missing."""
    for test, both in itertools.product(tests, pprs):
        first, second = (_of_cell(trials, test, ppr) for ppr in both)
        pair = equal_trials(first, second, pose)
        names = tuple(f'{ppr} PPR' for ppr in both)
        for quantity in quantities:
            values = tuple(final_errors(one, pose, quantity) for one in pair)
            yield Sample(f'{POSES[pose]} in {test}, {quantity.axis}', quantity, values, names)


def pairs_of_y_and_x(trials: pd.DataFrame, poses: Sequence[str], tests: Sequence[str]) -> Iterator[Sample]:
    """Pair the y and x errors of each trial."""
    for pose, test, ppr in itertools.product(poses, tests, PPRS):
        values = tuple(final_errors(_of_cell(trials, test, ppr), pose, axis) for axis in (Y, X))
        yield Sample(f'{POSES[pose]} in {test} at {ppr} PPR', X, values, ('y', 'x'))


def headings(trials: pd.DataFrame, pprs: Sequence[str]) -> Iterator[Sample]:
    """Yield the headings over all tests and in all three tables, because the claim does not name any."""
    of_tests = trials[trials['test'].isin(STANDARD_TESTS)]
    for pose, ppr in itertools.product(('odom', 'global', 'world'), pprs):
        values = final_errors(of_tests[of_tests['ppr'] == ppr], pose, YAW)
        yield Sample(f'{POSES[pose]} at {ppr} PPR, {YAW.axis}', YAW, (values,))


def claim_parts(trials: pd.DataFrame) -> Dict[str, Iterable[Part]]:
    """Return the parts of each claim of config/paper/claims.csv by its key."""
    of_standard = functools.partial(pairs_of_pprs, trials, tests=STANDARD_TESTS)
    long_drive = list(samples(trials, 'odom', ['DLD']))
    cells = list(itertools.product(STANDARD_TESTS, PPRS))
    fine, coarse = headings(trials, FINE), headings(trials, COARSE)
    return {
        'routes': every_trial('reached the goal', trials, lambda part: part['outcome'] == SUCCEEDED),
        'straight_heading': [spread(one, YAW.tolerance, -1) for one in samples(trials, 'odom', ['SL'], [YAW])],
        'turns': map(first_is_larger, pairs_of_pprs(trials, 'odom', ['SMT'], COARSE_AND_FINE, QUANTITIES)),
        'steadier': map(first_is_larger, of_standard('odom', pprs=COARSE_AND_FINE, quantities=QUANTITIES)),
        'drift': [first_is_larger(one, SIZE) for one in pairs_of_pprs(trials, 'odom', ['DLD'])],
        'true_position': map(first_is_larger, of_standard('world')),
        'across': map(first_is_larger, pairs_of_y_and_x(trials, ['odom', 'world'], ['SL', 'DLD'])),
        'long_drive_spread': [spread(one, 0.05) for one in long_drive],
        'long_drive_within': [fraction_within(one, 0.2, -1) for one in long_drive],
        'amcl_within': every_trial('within', trials, lambda part: are_within(part, 'global', (X, Y)), cells),
        'true_within': [fraction_within(one, 0.85) for one in samples(trials, 'world', STANDARD_TESTS)],
        'heading': [*(fraction_within(one, 0.9) for one in fine), *(fraction_within(one, 0.9, -1) for one in coarse)],
        'true_heading': map(first_is_larger, pairs_of_pprs(trials, 'world', ['DLD'], quantities=[YAW])),
        'amcl_resolution': map(fractions_equal, of_standard('global')),
        'amcl_global': every_trial('agree', trials, _agree),
    }


class ClaimResult(NamedTuple):
    """Claim with the results of its tests."""

    text: str
    where: str  # in the paper
    parts: List[Part]

    @property
    def conclusion(self) -> str:
        """Return the conclusion: one failed part contradicts a claim; all parts must hold to reproduce it."""
        conclusions = {part.conclusion for part in self.parts}
        if FAILS in conclusions or conclusions == {HOLDS}:
            return 'contradicted' if FAILS in conclusions else 'reproduced'
        return 'not contradicted' if self.p_text else 'not tested: too few trials'

    @property
    def p_text(self) -> str:
        """Return the smallest p-value of the parts; empty if none was tested."""
        p_value = min((part.p_value for part in self.parts if not math.isnan(part.p_value)), default=math.nan)
        text = f'p {p_value:.2g}' if p_value >= SMALLEST_P else f'p < {SMALLEST_P:g}'
        return '' if math.isnan(p_value) else text

    @property
    def counts(self) -> str:
        """Count the parts of the claim by their conclusions."""
        counts = Counter(part.conclusion for part in self.parts)
        return ', '.join(f'{one} {counts[one]}' for one in CONCLUSIONS if counts[one])


def check_claims(trials: pd.DataFrame) -> Dict[str, List[ClaimResult]]:
    """Test all claims on the trials of each value of the column `campaign`."""
    found, claims = {}, paper_table('claims').to_dict('records')
    for campaign, of_campaign in trials.groupby('campaign', sort=False):
        parts = claim_parts(of_campaign)
        found[campaign] = [ClaimResult(one['text'], one['where'], concluded(parts[one['key']])) for one in claims]
    return found
