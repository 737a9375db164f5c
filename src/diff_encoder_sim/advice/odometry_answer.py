"""Odometry error at the goal over the range of encoders, the lowest sufficient counts, and error budgets."""

from __future__ import annotations

import math
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import Answer, Budget, Criterion, Kind, Limit, Reach, Requirement
from diff_encoder_sim.advice.drive_draws import ALL_CAUSES, CONTACT, ROBOTS_CAUSES, Amounts, DriveDraws
from diff_encoder_sim.analysis.closed_form import STRAIGHT_WITHIN, closed_form_std
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.analysis.statistics import Interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

special = deferred('scipy.special')


def closed_form_counts(requested: Trial, robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the lowest counts per revolution at which odometry at the goal is within the tolerance.

    Across a straight line of length S the error is the difference of two phases that are uniform in a pulse d, times
    S / L: the fraction within tol is 1 - (1 - c)^2 with c = tol L / (S d). All other errors are assumed normal with
    `closed_form_std`. The axis that needs the most counts decides.
    """
    to_goal = requested.goal().relative_to(requested.test.start.pose())
    reach = np.full(3, _normal_reach(requirement.share))
    if max(abs(to_goal.y_m), abs(to_goal.yaw_rad)) <= STRAIGHT_WITHIN and to_goal.x_m != 0.0:
        # A triangle from -w to w has the standard deviation w / sqrt(6).
        reach[:2] = math.sqrt(6.0) * (1.0 - math.sqrt(1.0 - requirement.share))
    return float(np.max(closed_form_std(requested, robot, 1.0) * reach / requirement.tolerances))


def local_counts(robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the lowest counts at which the heading is within the tolerance for random wheel phases.

    Localization corrects all other errors; the rest is assumed normal with a standard deviation of (d / L) sqrt(1/3).
    """
    sd_of_one_count_rad = math.pi * robot.wheel_diameter_m / robot.wheel_separation_m / math.sqrt(3.0)
    return sd_of_one_count_rad * _normal_reach(requirement.share) / requirement.yaw_rad


def _normal_reach(share: float) -> float:
    return float(special.ndtri(0.5 + 0.5 * share))


FEWEST_COUNTS, MOST_COUNTS, PER_OCTAVE = 8.0, 65536.0, 4  # range of the curve, per revolution of the wheel
DRAWS = 1000
FINE_POINTS, FINE_DRAWS = 10, 8000  # finer steps and more draws near the required success rate


def share_within(errors: np.ndarray, requirement: Requirement) -> Interval:
    """Return the confidence interval of the success rate from (draws, 3) errors."""
    return wilson(int(requirement.within(errors).sum()), len(errors), requirement.confidence)


def monotone_fractions(counts: Sequence[Tuple[int, int]]) -> List[float]:
    """Fit fractions that do not fall from rank to rank: the largest of all smallest means from a rank to its right.

    `counts` are the draws within the tolerance, and all draws, by rank in ascending quality.
    """
    within, draws = np.cumsum([(0, 0), *counts], axis=0).T
    count = draws - draws[:, np.newaxis]  # from each rank up to each other one
    means = np.where(count > 0, within - within[:, np.newaxis], np.inf) / np.maximum(count, 1)
    smallest = np.minimum.accumulate(means[:-1, :0:-1], axis=1)[:, ::-1]
    of_left = np.where(np.tri(len(counts), dtype=bool).T, smallest, -np.inf)
    fitted: List[float] = of_left.max(axis=0, initial=-1).tolist()
    return fitted


class Curve(NamedTuple):
    """Final errors of one test, (draws, 3) odometry minus truth in the axes of the map: [m], [m], [rad]."""

    draws: DriveDraws
    errors: Dict[float, np.ndarray]  # by counts per revolution

    @property
    def test(self) -> str:
        """Return the name of the test."""
        return self.draws.drive.test


class OdometryCurves:
    """Curves of a robot's tests, one drive per test; `params` are of its encoder, whose counts are replaced."""

    def __init__(self, tests: Sequence[DriveDraws], params: EncoderParams, amounts: Amounts = ROBOTS_CAUSES) -> None:
        self._params, self._amounts = params, amounts
        counts = self._between(FEWEST_COUNTS, MOST_COUNTS, round(PER_OCTAVE * math.log2(MOST_COUNTS / FEWEST_COUNTS)))
        encoders = list(map(self.encoder, counts))
        self.curves = [Curve(draws, dict(zip(counts, draws.errors(encoders, DRAWS, amounts)))) for draws in tests]

    def encoder(self, counts: float) -> EncoderParams:
        """Return the robot's encoder with other counts per revolution."""
        return self._params.model_copy(update={'ppr': PerWheel(left=counts, right=counts)})

    @property
    def counts(self) -> List[float]:
        """Return the sampled counts per revolution, ascending."""
        return sorted(self.curves[0].errors)

    def share(self, counts: float, requirement: Requirement) -> Interval:
        """Return the interval of the success rate in the worst test."""
        return min(share_within(curve.errors[counts], requirement) for curve in self.curves)

    def smallest(self, requirement: Requirement) -> Optional[Tuple[float, Interval]]:
        """Return the lowest counts that meet the requirement, from too few to enough for certain; None if all fail."""
        roughly = self.roughly(requirement)
        if roughly is None:
            return None
        _, (before, after) = roughly
        between = self._between(before, after, FINE_POINTS)
        encoders = list(map(self.encoder, between))
        for curve in self.curves:
            is_met = share_within(curve.errors[before], requirement).low >= requirement.share
            errors = curve.draws.errors(encoders, DRAWS if is_met else FINE_DRAWS, self._amounts)
            curve.errors.update(zip(between, errors))
        return self.roughly(requirement)

    def roughly(self, requirement: Requirement) -> Optional[Tuple[float, Interval]]:
        """Return the smallest counts that suffice with all larger ones: fewer may be better by chance."""
        counts = self.counts
        shares = np.array([self.share(each, requirement) for each in counts])
        certain, possible = (max(np.flatnonzero(~is_met), default=-1) + 1 for is_met in (shares >= requirement.share).T)
        if certain == len(counts):
            return None
        # Where a monotone fit of each curve reaches the required fraction.
        likely = too_few = counts[max(0, possible - 1)]
        for curve in self.curves:
            within = [requirement.within(curve.errors[each]) for each in counts]
            fractions = monotone_fractions([(int(each.sum()), len(each)) for each in within])
            crossing = float(np.exp(np.interp(requirement.share, fractions, np.log(counts))))
            likely = max(likely, *self.whole([crossing]))
        return min(likely, counts[certain]), Interval(too_few, counts[certain])

    def _between(self, low: float, high: float, steps: int) -> List[float]:
        return self.whole(np.geomspace(low, high, steps + 1).tolist())

    def whole(self, counts: Sequence[float]) -> List[float]:
        """Return the nearest counts that the encoder can have, ascending and unique."""
        model = self._params.encoder
        step = model.counts_that_repeat * model.shaft_turns_per_wheel_turn
        return sorted({step * max(1, round(each / step)) for each in counts})


def counts_by_ppr(params: EncoderParams) -> EncoderParams:
    """Return the encoder with its counts set by `ppr` instead of its datasheet."""
    free = params.encoder.model_copy(update={'lines': None, 'pole_pairs': None, 'bits': None})
    return params.model_copy(update={'encoder': free})


QUANTISATION, EDGES, MISSED = 'quantisation', 'edge errors', 'missed counts'
ENCODER_CAUSES = (EDGES, MISSED)  # besides quantisation
# Encoder parameters that cause EDGES in proportion to their values; UNEVEN_LINES also cause EDGES.
SENSOR_ERRORS = (
    *('edge_error', 'sensor_error', 'eccentricity', 'first_harmonic', 'second_harmonic'),
    *('noise', 'hysteresis', 'backlash'),
)
UNEVEN_LINES = ('duty_cycle', 'phase_error')
BUDGET_DRAWS = 1000


def odometry_budgets(draws: DriveDraws, encoders: Sequence[EncoderParams]) -> List[Budget]:
    """Return the error budget with each encoder.

    Slip on the simulated floor is a separate part because it belongs to the simulator, not to the robot.
    """
    kinds = zip(encoders, map(_without_faults, encoders), map(ideal_of, encoders))
    bare, *errors = _errors(draws, [None, *(encoder for of_one in kinds for encoder in of_one)], {})
    of_wheels = {cause: answers.part_of(by_cause) for cause, by_cause in wheel_errors(draws).items()}
    budgets = []
    for index, total in enumerate(_errors(draws, encoders, ALL_CAUSES)):
        faulty, sound, ideal = errors[3 * index : 3 * index + 3]
        parts = {QUANTISATION: answers.part_of(ideal - bare)}
        if _without_faults(encoders[index]).encoder != IDEAL_ENCODER:
            # Edge errors interact with quantisation, so their variance is a difference of variances.
            parts[EDGES] = answers.added(sound, ideal)
        if encoders[index].encoder.faults != NO_FAULTS:
            parts[MISSED] = answers.part_of(faulty - sound)
        budgets.append(Budget({**parts, **of_wheels}, answers.part_of(total)))
    return budgets


def wheel_errors(draws: DriveDraws) -> Dict[str, np.ndarray]:
    """Return the (draws, 3) odometry errors by AXES that only one wheel error causes, with any encoder."""
    (bare,) = _errors(draws, [None], {})
    return {cause: _errors(draws, [None], {cause: 1.0})[0] - bare for cause in draws.causes}


def _errors(
    draws: DriveDraws, encoders: Sequence[Optional[EncoderParams]], amounts: Amounts, count: Optional[int] = None
) -> List[np.ndarray]:
    found = draws.errors(encoders, BUDGET_DRAWS if count is None else count, amounts)
    return [answers.along_goal(errors, draws.drive.goal_in_map) for errors in found]


def ideal_of(encoder: EncoderParams) -> EncoderParams:
    """Return an error-free encoder with the same counts."""
    return encoder.model_copy(update={'ppr': encoder.counts_per_turn, 'encoder': IDEAL_ENCODER})


def _without_faults(encoder: EncoderParams) -> EncoderParams:
    return encoder.model_copy(update={'encoder': encoder.encoder.model_copy(update={'faults': NO_FAULTS})})


def odometry_answer(curves: OdometryCurves, requirement: Requirement) -> Answer:
    """Return the answer from the curves."""
    smallest = curves.smallest(requirement)
    if smallest is not None:
        return Answer(Criterion.ODOMETRY, Kind.FROM, *smallest)
    finest = curves.encoder(curves.counts[-1])
    if curves.share(finest.counts_per_turn.left, requirement).high >= requirement.share:
        note = f'success rate near {requirement.share:g} at up to {MOST_COUNTS:g} counts'
        return Answer(Criterion.ODOMETRY, Kind.UNDECIDED, note=note)
    tests = [curve.draws for curve in curves.curves]
    return limited_answer(tests, finest, requirement)._replace(reach=_reach(tests, requirement))


def _reach(tests: Sequence[DriveDraws], requirement: Requirement) -> Optional[Reach]:
    """Return the error of the wheels in the worst test and how far the tolerance holds; None if to the end."""
    share, tolerances = requirement.share, requirement.tolerances
    errors = [draws.errors([None], DRAWS)[0] for draws in tests]
    of_tests = [float(np.quantile((np.abs(each) / tolerances).max(axis=1), share)) for each in errors]
    fraction, worst = max(zip(of_tests, range(len(tests))))
    if share_within(errors[worst], requirement).high >= share:
        return None
    draws = tests[worst]
    of_axes = np.abs(answers.along_goal(errors[worst], draws.drive.goal_in_map)) / tolerances
    axis = int(np.quantile(of_axes, share, axis=0).argmax())
    within = (np.abs(draws.errors_under_way(DRAWS)) <= tolerances).all(axis=2).mean(axis=0)
    about = draws.drive.test, answers.AXES[axis], fraction * float(tolerances[axis]), float(tolerances[axis])
    return Reach(*about, draws.travel(-1), draws.travel(int(np.argmax(within < share)) - 1))


def limited_answer(tests: Sequence[DriveDraws], params: EncoderParams, requirement: Requirement) -> Answer:
    """Return the answer for an encoder whose counts suffice but whose errors are too large."""
    # Whether an encoder without quantisation and errors meets the requirement on these wheels.
    shares = [share_within(draws.errors([None], DRAWS, ROBOTS_CAUSES)[0], requirement) for draws in tests]
    is_its_own = all(share.low >= requirement.share for share in shares)
    of_wheels = {
        (cause, draws.drive.test): errors
        for draws in tests
        for cause, errors in wheel_errors(draws).items()
        if cause != CONTACT
    }
    found = answers.limits(of_wheels, requirement) + own_limits(tests, params, requirement, is_its_own)
    found.sort(key=lambda limit: -limit.fraction)
    amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
    on_wheels = {cause: amounts.get(cause, amount) for cause, amount in ROBOTS_CAUSES.items()}
    with_less = OdometryCurves(tests, _with_less(counts_by_ppr(params), amounts), on_wheels).roughly(requirement)
    counts = with_less and with_less[0]
    return Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, counts, limits=found, of_encoder=is_its_own)


def own_limits(
    tests: Sequence[DriveDraws],
    encoder: EncoderParams,
    requirement: Requirement,
    is_too_much: bool,
    count: Optional[int] = None,
) -> List[Limit]:
    """Return the encoder errors, except quantisation, that are too large; if only their sum is, the worst one."""
    by_place = {}
    for draws in tests:
        kinds = [encoder, _without_faults(encoder), ideal_of(encoder)]
        faulty, sound, ideal = _errors(draws, kinds, {}, count)
        by_place.update({(EDGES, draws.drive.test): sound - ideal, (MISSED, draws.drive.test): faulty - sound})
    found = {place: errors for place, errors in by_place.items() if errors.any()}
    return answers.limits(found, requirement, is_too_much)


def _with_less(params: EncoderParams, amounts: Mapping[str, float]) -> EncoderParams:
    """Return the encoder with its errors reduced to these fractions."""
    model = params.encoder
    faults = {key: getattr(model.faults, key) * amounts.get(MISSED, 1.0) for key in ('missed', 'extra')}
    errors = {key: getattr(model, key) * amounts.get(EDGES, 1.0) for key in SENSOR_ERRORS}
    less = model.model_copy(update={**errors, 'faults': model.faults.model_copy(update=faults)})
    return params.model_copy(update={'encoder': less})
