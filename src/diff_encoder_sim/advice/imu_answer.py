"""Odometry fused with an IMU: lowest sufficient counts, counts of equal error without the IMU, and error budget."""

from __future__ import annotations

import math
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import AXES, Budget, Part, Requirement, amount_text
from diff_encoder_sim.advice.drive_draws import Amounts
from diff_encoder_sim.advice.fused_draws import FUSED_CAUSES, STANDSTILL_S, FusedDraws
from diff_encoder_sim.advice.odometry_answer import MOST_COUNTS, QUANTISATION, Curve, OdometryCurves, odometry_budgets
from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.rounding import rounded
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.robots.wheel_quality import WheelQuality
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

COUNTS = (10.0, 20.0, 40.0, 90.0, 250.0, 1024.0, 4096.0)  # of the curve, per revolution of the wheel
MOST_DRAWS, FEWEST_DRAWS, STEPS = 300, 50, 400_000  # fewer draws of drives with more reports
RESAMPLED = 400  # bootstrap samples
LEAST_IN_TEXT = np.array([1e-3, 1e-3, math.radians(0.1)])  # of effects by AXES
SHOWN = {'along [mm]': (1e3, 1), 'across [mm]': (1e3, 1), 'heading [deg]': (math.degrees(1.0), 2)}  # scale, decimals
EQUAL = 'any: the error is below that of all encoders without an IMU. less: not better than without.'


class Estimate(NamedTuple):
    """Counts per revolution with their interval; infinite: more than any encoder has."""

    counts: float
    low: float
    high: float

    def __str__(self) -> str:
        return '{} ({} to {})'.format(*(f'{rounded(each, 3):g}' if each <= MOST_COUNTS else 'any' for each in self))


class FusedCurve(NamedTuple):
    """Final errors of one test with an IMU."""

    plain: Curve  # without the IMU
    fused: FusedDraws
    errors: Dict[float, np.ndarray]  # (draws, 3) by counts, as those of `plain`
    equal: Dict[float, Estimate]  # counts without the IMU that have the same error, by counts

    @property
    def drive(self) -> str:
        """Return the path and the time without the standstill: `20 m in 46 s`."""
        return f'{self.plain.draws.travel(-1)} in {self.plain.draws.drive.rolled.times_s[-1]:.0f} s'


class ImuAnswer(NamedTuple):
    """Answer for odometry with an IMU on wheels of one quality."""

    name: str
    params: ImuParams
    wheels: WheelQuality
    counts: float  # whose equivalents are in the text, and that the budgets are of
    smallest: Estimate  # counts that suffice in all tests; infinite: none of COUNTS do
    curves: List[FusedCurve]
    budgets: Dict[str, Tuple[Budget, Budget]]  # by test: without and with the IMU; may be empty

    @property
    def draws(self) -> int:
        """Return the number of draws at each resolution."""
        return min(len(errors) for curve in self.curves for errors in curve.errors.values())

    def __str__(self) -> str:
        lowest, low, high = self.smallest
        if low > COUNTS[-1]:
            enough = f'even {COUNTS[-1]:g} counts do not suffice'
        elif high > COUNTS[-1]:
            enough = 'the success rate is near the required one with any counts'
        elif high <= COUNTS[0]:
            enough = f'{COUNTS[0]:g} counts per wheel turn suffice'
        else:
            enough = f'at least {lowest:.3g} counts per wheel turn (between {low:.3g} and {high:.3g})'
        worth = (f'{self._worth(curve.equal[self.counts])} over {curve.drive}' for curve in self.curves)
        return '; '.join([enough, *worth])

    def _worth(self, equal: Estimate) -> str:
        if equal.low > MOST_COUNTS:
            return f'{self.counts:g} counts are better than any without IMU'
        worth = f'equal {equal} without IMU' if equal.low > self.counts else 'are not better than without IMU'
        return f'{self.counts:g} counts {worth}'

    @property
    def compensated(self) -> str:
        """Return the standard deviations by the wheels with and without the IMU, each along its worst axis."""
        found = []
        for test, (without, with_imu) in self.budgets.items():
            for cause in [each for each in with_imu.parts if each in without.parts and each != QUANTISATION]:
                axis = int((without.parts[cause].std / LEAST_IN_TEXT).argmax())
                after, before = (abs(float(each.parts[cause].std[axis])) for each in (with_imu, without))
                if before >= LEAST_IN_TEXT[axis]:
                    amounts = ' instead of '.join(amount_text(each, AXES[axis]) for each in (after, before))
                    found.append(f'{cause} in {test}: {amounts}')
        return f'{"; ".join(found)} ({self.wheels.text}, {self.counts:g} counts)' if found else ''


def imu_answer(
    name: str,
    imu: ImuParams,
    wheels: WheelQuality,
    curves: OdometryCurves,
    requirement: Requirement,
    rate_hz: float,
    more_counts: Sequence[float],
    has_budgets: bool,
) -> ImuAnswer:
    """Sample odometry with an IMU at COUNTS and `more_counts`, whose first are shown; compare it with the curves."""
    counts, rng, confidence = curves.whole([*COUNTS, *more_counts]), generator(0, name), requirement.confidence
    (shown,), found, of_tests = curves.whole(more_counts[:1]), [], []
    for curve in curves.curves:
        fused = FusedDraws(curve.draws, imu, rate_hz)
        errors = dict(zip(counts, fused.errors([*map(curves.encoder, counts)], draws_of(fused), FUSED_CAUSES)))
        with_imu, without = (_resampled(each, requirement, rng) for each in (errors, curve.errors))
        equal = (_estimate(_crossings(sorted(curve.errors), without, each), confidence) for each in with_imu.T)
        found.append(FusedCurve(curve, fused, errors, dict(zip(counts, equal))))
        of_tests.append(with_imu)
    smallest = _estimate(_crossings(counts, np.max(of_tests, axis=0), np.ones(1 + RESAMPLED)), confidence)
    budgets = {each.plain.test: _budgets(each, curves.encoder(shown)) for each in found if has_budgets}
    return ImuAnswer(name, imu, wheels, shown, smallest, found, budgets)


def draws_of(fused: FusedDraws) -> int:
    """Return the number of draws, by the number of reports."""
    return int(np.clip(STEPS // len(fused.drive.rolled.times_s), FEWEST_DRAWS, MOST_DRAWS))


def _budgets(curve: FusedCurve, encoder: EncoderParams) -> Tuple[Budget, Budget]:
    """Return the error budgets without and with the IMU."""
    fused, goal = curve.fused, curve.fused.drive.goal_in_map

    def errors(amounts: Amounts) -> np.ndarray:
        return answers.along_goal(fused.errors([encoder], draws_of(fused), amounts)[0], goal)

    # The counts set the gains of the filter, so that each cause is the difference to quantisation only.
    ideal = errors({})
    parts = {cause: answers.added(errors({cause: 1.0}), ideal) for cause in fused.causes}
    with_imu = Budget({QUANTISATION: answers.part_of(ideal), **parts}, answers.part_of(errors(FUSED_CAUSES)))
    return odometry_budgets(curve.plain.draws, [encoder])[0], with_imu


def _resampled(errors: Dict[float, np.ndarray], requirement: Requirement, rng: np.random.Generator) -> np.ndarray:
    """Return (1 + RESAMPLED, counts) errors that the required fraction does not exceed, in units of the tolerance.

    The first row is that of the draws. The order statistic k of a bootstrap sample of n draws is the draw of rank n B,
    rounded up, with B of the beta distribution (k, n - k + 1).
    """
    draws = min(map(len, errors.values()))
    rank = math.ceil(requirement.share * draws)
    ranks = np.ceil(draws * rng.beta(rank, draws - rank + 1, RESAMPLED)).astype(np.int64)
    ordered = np.sort([(np.abs(errors[each][:draws]) / requirement.tolerances).max(axis=1) for each in sorted(errors)])
    return np.asarray(ordered[:, np.append(rank, ranks) - 1].T)


def _crossings(counts: Sequence[float], errors: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the (n,) lowest counts whose error, of (n, counts), is at most its level (n,); infinite if none is."""
    falling, levels = (np.log(np.maximum(each, 1e-12)) for each in (np.minimum.accumulate(errors, axis=1), levels))
    logs = (
        np.interp(-level, -each, np.log(counts)) if each[-1] <= level else math.inf
        for each, level in zip(falling, levels)
    )
    return np.asarray(np.exp(np.fromiter(logs, float)))


def _estimate(counts: np.ndarray, confidence: float) -> Estimate:
    """Return the first of (1 + RESAMPLED,) counts with the interval of the others."""
    low, high = np.quantile(counts[1:], (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence), method='nearest')
    return Estimate(*(rounded(float(each), 4) for each in (counts[0], min(low, counts[0]), max(high, counts[0]))))


def imu_rows(imus: Sequence[ImuAnswer]) -> List[Tuple[str, str]]:
    """Return the answers with their heads, and the part of the wheels' errors that remains with the first IMU."""
    rows = [(f'odometry with {each.wheels.text} and {each.name}', str(each)) for each in imus]
    return rows + [(f'errors with {each.name}', each.compensated) for each in imus if each.compensated]


def imu_assumptions(imus: Sequence[ImuAnswer]) -> str:
    """Return the assumptions about IMUs, and the number of draws."""
    rest = f'{STANDSTILL_S:g} s at rest before each drive, which determine the bias'
    return f'with an IMU: {rest}; {min(answer.draws for answer in imus)} sampled drives'


def imu_tables(imus: Sequence[ImuAnswer]) -> Iterator[TextTable]:
    """Yield a table of equivalent counts for each quality of the wheels, and the error budgets with the first IMU."""
    for wheels in dict.fromkeys(answer.wheels for answer in imus):
        by_imu = {answer.name: answer.curves for answer in imus if answer.wheels == wheels}
        rows = [
            [curves[0].drive, f'{counts:g}', *(_cell(counts, curve.equal[counts]) for curve in curves)]
            for curves in zip(*by_imu.values())
            for counts in curves[0].equal
        ]
        title = f'Counts without an IMU that have the same error as counts with one, {wheels.text}'
        yield TextTable(title, ['drive', 'counts', *by_imu], rows, EQUAL, 1)
    for answer in imus:
        for test, budgets in answer.budgets.items():
            of_rows = [each.every for each in budgets]
            rows = [[cause, *_changes([each.get(cause) for each in of_rows])] for cause in [*budgets[1].parts, 'found']]
            about = f'{test}, {answer.counts:g} counts, {answer.wheels.text}'
            title = f'Standard deviations without → with {answer.name}: {about}'
            yield TextTable(title, ['cause', *SHOWN], rows, texts=1)


def _cell(counts: float, equal: Estimate) -> str:
    return 'any' if equal.low > MOST_COUNTS else f'less: {equal}' if equal.low <= counts else str(equal)


def _changes(parts: Sequence[Optional[Part]]) -> List[str]:
    """Return a text by axis of a cause without and with the IMU; None: it has no part."""
    return [
        ' → '.join(f'{abs(each.std[axis]) * scale:.{decimals}f}' if each else '–' for each in parts)
        for axis, (scale, decimals) in enumerate(SHOWN.values())
    ]
