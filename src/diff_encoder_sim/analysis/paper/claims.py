"""The paper's claims in our own words, and the hypothesis tests of their parts on our trials."""

from __future__ import annotations

import enum
import math
from typing import Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.dataset import STANDARD_TESTS, Dataset, TrialData, Varied
from diff_encoder_sim.analysis.final_errors import (
    count_within,
    count_within_all,
    equal_trials,
    final_error,
    final_errors,
    with_final_error,
)
from diff_encoder_sim.analysis.paired_statistics import (
    SIGNIFICANCE,
    PairedResult,
    holm,
    mcnemar,
    spread_ratio,
    wilcoxon,
)
from diff_encoder_sim.analysis.paper.paper_cells import PPRS, TRIALS
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, Quantity, X, Y
from diff_encoder_sim.analysis.sample_statistics import Interval, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome


class Conclusion(enum.Enum):
    """What a hypothesis test shows."""

    HOLDS = 'holds'
    FAILS = 'fails'
    UNCLEAR = 'unclear'


class PartResult(NamedTuple):
    """A part of a claim, tested for itself."""

    text: str  # with the numbers
    holds: bool  # with 95 % confidence
    p_against: float  # of the part being true; 1 where our trials are on the claim's side


class HypothesisTest(NamedTuple):
    """The test of one part of a claim."""

    conclusion: Conclusion
    text: str  # with the numbers
    p_against: Optional[float] = None  # corrected for the number of parts; None without enough trials


def concluded(parts: Iterable[PartResult]) -> List[HypothesisTest]:
    """Conclude from all parts of a claim, which are corrected for their number."""
    parts = list(parts)
    return [
        HypothesisTest(_conclusion(part, p_value), part.text, p_value)
        for part, p_value in zip(parts, holm([part.p_against for part in parts]))
    ]


def too_few(label: str) -> HypothesisTest:
    """Return the test of a part without enough trials."""
    return HypothesisTest(Conclusion.UNCLEAR, f'{label}: too few trials')


def _conclusion(part: PartResult, p_against: float) -> Conclusion:
    if p_against < SIGNIFICANCE:
        return Conclusion.FAILS
    return Conclusion.HOLDS if part.holds else Conclusion.UNCLEAR


# The trials of one set of parameters, by test and PPR.
TrialsByCell = Dict[Tuple[str, str], List[TrialData]]


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


def samples(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantities: Sequence[Quantity]
) -> List[Sample]:
    """Return a sample for each cell and quantity; it is empty where there is no such cell."""
    return [
        Sample(
            f'{TOPIC_OF_SOURCE[source]} in {test} at {ppr} PPR, {quantity.axis}',
            final_errors(trials.get((test, ppr), []), source, quantity),
            quantity,
        )
        for test in tests
        for ppr in pprs
        for quantity in quantities
    ]


def pairs_of_pprs(
    trials: TrialsByCell,
    source: PoseSource,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]],
    quantities: Sequence[Quantity],
) -> List[Pair]:
    """Pair equal trials with two encoders; a pair is empty where one of them is missing."""
    pairs = []
    for test in tests:
        for first, second in pprs:
            cells = equal_trials(trials.get((test, first), []), trials.get((test, second), []), source)
            pairs += [
                Pair(
                    f'{TOPIC_OF_SOURCE[source]} in {test}, {quantity.axis}',
                    (f'{first} PPR', f'{second} PPR'),
                    (final_errors(cells[0], source, quantity), final_errors(cells[1], source, quantity)),
                    quantity,
                )
                for quantity in quantities
            ]
    return pairs


def pairs_of_y_and_x(trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str]) -> List[Pair]:
    """Pair both errors of position of each trial."""
    pairs = []
    for test in tests:
        for ppr in pprs:
            cell = trials.get((test, ppr), [])
            label = f'{TOPIC_OF_SOURCE[source]} in {test} at {ppr} PPR'
            pairs.append(Pair(label, ('y', 'x'), (final_errors(cell, source, Y), final_errors(cell, source, X)), X))
    return pairs


def pooled_over_tests(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantity: Quantity
) -> List[Sample]:
    """Return a sample for each encoder over all tests."""
    return [
        Sample(
            f'{TOPIC_OF_SOURCE[source]} at {ppr} PPR, {quantity.axis}',
            final_errors([trial for test in tests for trial in trials.get((test, ppr), [])], source, quantity),
            quantity,
        )
        for ppr in pprs
    ]


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


# A smaller difference is negligible, as a fraction of the tolerance.
NEGLIGIBLE_FRACTION = 0.1


class _Count(NamedTuple):
    """In how many trials of a cell the claim is true."""

    label: str
    true: int
    trials: int


def all_succeeded(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that every trial reached its goal."""
    return _tests(
        'reached the goal',
        [
            _Count(_label(*cell), sum(trial.outcome is Outcome.SUCCEEDED for trial in of_cell), len(of_cell))
            for cell, of_cell in trials.items()
        ],
    )


def all_within(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str]
) -> List[HypothesisTest]:
    """Test that every trial ends within tolerance in x and in y."""
    cells = {(test, ppr): trials.get((test, ppr), []) for test in tests for ppr in pprs}
    return _tests(
        'within',
        [
            _Count(_label(*cell), count_within_all(of_cell, source, (X, Y)), len(with_final_error(of_cell, source)))
            for cell, of_cell in cells.items()
        ],
    )


def amcl_matches_global(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that the final /amcl_pose and /global_pose agree to a tenth of the tolerance, in every trial."""
    counts = []
    for cell, of_cell in trials.items():
        agree = [_is_negligible(trial) for trial in of_cell if _has_both(trial)]
        counts.append(_Count(_label(*cell), sum(agree), len(agree)))
    return _tests('agree', counts)


def _tests(what: str, counts: Sequence[_Count]) -> List[HypothesisTest]:
    """Compare each cell's count, and that of all, with as many of the paper's trials, all of them true."""
    counted = [one for one in counts if one.trials]
    parts = [_part_every_trial(what, one, TRIALS) for one in counted]
    if len(counted) > 1:
        every = _Count('all cells', sum(one.true for one in counted), sum(one.trials for one in counted))
        parts.append(_part_every_trial(what, every, TRIALS * len(counted)))
    return [*(too_few(one.label) for one in counts if not one.trials), *concluded(parts)]


def _part_every_trial(what: str, count: _Count, theirs: int) -> PartResult:
    _, p_value = stats.fisher_exact(np.array([[count.true, count.trials - count.true], [theirs, 0]]))
    text = f'{count.label}: {count.true} of {count.trials} {what}, the paper {theirs} of {theirs}, p {p_value:.2g}'
    return PartResult(text, count.true == count.trials, float(p_value))


def _label(test: str, ppr: str) -> str:
    return f'{test} at {ppr} PPR'


def _has_both(trial: TrialData) -> bool:
    return all(final_error(trial, source) is not None for source in (PoseSource.AMCL, PoseSource.GLOBAL))


def _is_negligible(trial: TrialData) -> bool:
    amcl, estimate = final_error(trial, PoseSource.AMCL), final_error(trial, PoseSource.GLOBAL)
    if amcl is None or estimate is None:
        return False
    difference = (amcl.x_m - estimate.x_m, amcl.y_m - estimate.y_m, wrap_angle(amcl.yaw_rad - estimate.yaw_rad))
    return all(
        quantity.scale * abs(difference[quantity.component]) <= NEGLIGIBLE_FRACTION * quantity.tolerance
        for quantity in QUANTITIES
    )


ODOM, GLOBAL, WORLD = PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = [(coarse, fine) for coarse in COARSE for fine in FINE]
EXTREMES = [(PPRS[0], PPRS[-1])]


class Claim(NamedTuple):
    """A statement of the paper about its results."""

    text: str
    where: str  # in the paper
    test: Callable[[TrialsByCell], List[HypothesisTest]]  # a hypothesis test for each part


def _heading_by_resolution(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test the heading over all tests, as the claim does, in all three tables: it does not name one."""
    above, below = (
        [
            one
            for source in (ODOM, GLOBAL, WORLD)
            for one in pooled_over_tests(trials, source, STANDARD_TESTS, pprs, YAW)
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


# Smaller p-values are shown as smaller than this.
SMALLEST_P = 1e-4


class ClaimResult(NamedTuple):
    """A claim and what our trials show."""

    text: str
    where: str  # in the paper
    varied: Varied  # parameters that set these trials apart from others of the dataset
    conclusion: str
    tests: List[HypothesisTest]

    @property
    def p_text(self) -> str:
        """Return the p-value of the part that speaks most against the claim; empty where none was tested."""
        p_value = min((test.p_against for test in self.tests if test.p_against is not None), default=None)
        return '' if p_value is None else f'p {p_value:.2g}' if p_value >= SMALLEST_P else f'p < {SMALLEST_P:g}'

    @property
    def counts(self) -> str:
        """Count the parts of the claim by their conclusions."""
        counts = {conclusion: sum(test.conclusion is conclusion for test in self.tests) for conclusion in Conclusion}
        return ', '.join(f'{conclusion.value} {count}' for conclusion, count in counts.items() if count)


def check_claims(dataset: Dataset) -> List[ClaimResult]:
    """Test every claim, for each set of varied parameters."""
    by_varied: Dict[Varied, TrialsByCell] = {}
    for cell, trials in dataset.cells().items():
        by_varied.setdefault(cell.varied, {})[cell.test, cell.ppr] = trials
    return [_result(claim, varied, cells) for varied, cells in by_varied.items() for claim in CLAIMS]


def claim_conclusion(tests: Sequence[HypothesisTest]) -> str:
    """Conclude from the parts: one that fails contradicts a claim, all must hold to reproduce it."""
    conclusions = [test.conclusion for test in tests]
    if Conclusion.FAILS in conclusions:
        return 'contradicted'
    if conclusions and all(one is Conclusion.HOLDS for one in conclusions):
        return 'reproduced'
    return 'not contradicted' if any(test.p_against is not None for test in tests) else 'not tested: too few trials'


def _result(claim: Claim, varied: Varied, cells: TrialsByCell) -> ClaimResult:
    tests = claim.test(cells)
    return ClaimResult(claim.text, claim.where, varied, claim_conclusion(tests), tests)
