"""Odometry fused with an IMU: lowest sufficient counts, counts of equal error without the IMU, and error budget."""

from __future__ import annotations

import math
from typing import Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import AXES, Budget, Requirement, amount_text
from diff_encoder_sim.advice.drive_draws import Amounts
from diff_encoder_sim.advice.fused_draws import FUSED_CAUSES, FusedDraws
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


class Estimate(NamedTuple):
    """Counts per revolution with their interval; infinite: more than any encoder has."""

    counts: float
    low: float
    high: float

    def __str__(self) -> str:
        counts, low, high = (f'{rounded(each, 3):g}' if each <= MOST_COUNTS else 'any' for each in self)
        return f'{counts} ({low} to {high})' if counts != 'any' else 'any' if low == 'any' else f'at least {low}'


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
    draws: int  # at each resolution

    def __str__(self) -> str:
        lowest, low, high = (rounded(each, 3) for each in self.smallest)
        enough = f'at least {lowest:g} counts per wheel turn (between {low:g} and {high:g})'
        if high <= COUNTS[0]:
            enough = f'{high:g} counts per wheel turn suffice'
        elif low > COUNTS[-1]:
            enough = f'even {COUNTS[-1]:g} counts do not suffice'
        elif high > COUNTS[-1]:
            enough = 'the success rate is near the required one with any counts'
        for curve in self.curves:
            equal, worth = curve.equal[self.counts], 'are not better than without IMU'
            if equal.low > self.counts:
                worth = f'equal {equal} without IMU' if equal.low <= MOST_COUNTS else 'are better than any without IMU'
            enough += f'; {self.counts:g} counts {worth} over {curve.drive}'
        return enough

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
    all_fused = [FusedDraws(each.draws, imu, rate_hz) for each in curves.curves]
    draws = int(np.clip(STEPS // max(len(each.drive.rolled.times_s) for each in all_fused), FEWEST_DRAWS, MOST_DRAWS))
    runs = np.vstack([np.arange(draws), rng.integers(draws, size=(RESAMPLED, draws))])
    for curve, fused in zip(curves.curves, all_fused):
        errors = fused.errors([*map(curves.encoder, counts)], draws, FUSED_CAUSES)
        plain = curve.draws.errors([*map(curves.encoder, sorted(curve.errors))], draws)  # of the same wheels
        with_imu, without = (_resampled(each, requirement, runs) for each in (errors, plain))
        equal = (_estimate(_crossings(sorted(curve.errors), without, each), confidence) for each in with_imu.T)
        found.append(FusedCurve(curve, fused, dict(zip(counts, errors)), dict(zip(counts, equal))))
        of_tests.append(with_imu)
    smallest = _estimate(_crossings(counts, np.max(of_tests, axis=0), np.ones(1 + RESAMPLED)), confidence)
    budgets = {each.plain.test: _budgets(each, curves.encoder(shown), draws) for each in found if has_budgets}
    return ImuAnswer(name, imu, wheels, shown, smallest, found, budgets, draws)


def _budgets(curve: FusedCurve, encoder: EncoderParams, draws: int) -> Tuple[Budget, Budget]:
    """Return the error budgets without and with the IMU."""

    def errors(amounts: Amounts) -> np.ndarray:
        return answers.along_goal(curve.fused.errors([encoder], draws, amounts)[0], curve.fused.drive.goal_in_map)

    ideal = errors({})  # the counts set the gains of the filter: each cause is the difference to quantisation only
    parts = {cause: answers.added(errors({cause: 1.0}), ideal) for cause in curve.fused.causes}
    with_imu = Budget({QUANTISATION: answers.part_of(ideal), **parts}, answers.part_of(errors(FUSED_CAUSES)))
    return odometry_budgets(curve.plain.draws, [encoder])[0], with_imu


def _resampled(errors: Sequence[np.ndarray], requirement: Requirement, runs: np.ndarray) -> np.ndarray:
    """Return (n, counts) errors that the required fraction of `runs` (n, draws) does not exceed, in tolerances."""
    worst = np.array([(np.abs(each) / requirement.tolerances).max(axis=1) for each in errors])
    return np.array([np.quantile(worst[:, chosen], requirement.share, axis=1) for chosen in runs])


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


def imu_tables(imus: Sequence[ImuAnswer]) -> Iterator[TextTable]:
    """Yield a table of equivalent counts for each quality of the wheels."""
    for wheels in dict.fromkeys(answer.wheels for answer in imus):
        by_imu = {answer.name: answer.curves for answer in imus if answer.wheels == wheels}
        rows = [
            [curves[0].drive, f'{counts:g}', *(str(curve.equal[counts]) for curve in curves)]
            for curves in zip(*by_imu.values())
            for counts in curves[0].equal
        ]
        title, note = f'Counts with an IMU, and without: {wheels.text}', 'any: no encoder without an IMU is as good.'
        yield TextTable(title, ['drive', 'counts', *by_imu], rows, note, 1)
