"""Odometry part of an advice: candidates and listed encoders on the wheels of this robot, curves and budgets."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.advice import drive_draws, odometry_answer
from diff_encoder_sim.advice.answers import Answer, Budget, Criterion, Kind, Limit, Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.encoder_search import TrialCounts
from diff_encoder_sim.advice.imu_answer import ImuAnswer, imu_answer
from diff_encoder_sim.advice.odometry_answer import OdometryCurves, closed_form_counts, odometry_budgets, share_within
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.drives.test_definition import Segment
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file, robot_names
from diff_encoder_sim.robots.wheel_quality import CALIBRATED, EXACT, QUALITIES, WheelQuality
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.wheels.catalogue import OF_ROBOT, WHOLE_CATALOGUE, ChosenEncoder, EncoderFileParams, load_encoders
from diff_encoder_sim.wheels.covariance import PULSE_VARIANCE
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

DRAWS, FEW_DRAWS = 8000, 500  # as FINE_DRAWS of the curve; few draws refuse most insufficient encoders
LISTED_DRAWS = 400


class Candidate(NamedTuple):
    """Candidate encoder."""

    label: str
    counts: float  # of the equivalent ideal encoder
    params: EncoderParams
    name: str = ''  # of a real one, or `own of burger`
    real: Optional[EncoderFileParams] = None  # file of a real one


def candidates_of(campaign: Campaign) -> List[Candidate]:
    """Return the encoders of a campaign in ascending equivalent counts."""
    cells = campaign.cells[: len(campaign.encoders)]
    encoders = [
        (cell.encoder, cell.robot_params.encoder.model_copy(update={'ppr': cell.encoder.ppr})) for cell in cells
    ]
    return ordered_candidates(encoders, campaign.robot.name, campaign.robot.file.ppr)


def ordered_candidates(
    encoders: Iterable[Tuple[ChosenEncoder, EncoderParams]], robot: str, own_counts: Optional[float]
) -> List[Candidate]:
    """Return encoders in ascending equivalent counts; one with the robot's own counts has its name."""
    found, own = [], own_counts and PerWheel(left=own_counts, right=own_counts)
    for encoder, params in encoders:
        name = encoder.name or (f'own of {robot}' if params.ppr == own else '')
        found.append(Candidate(encoder.label, equivalent_counts(params), params, name, encoder.real))
    return sorted(found, key=lambda candidate: candidate.counts)


def equivalent_counts(params: EncoderParams) -> float:
    """Return the counts of the ideal encoder whose readings have the mean variance of both wheels."""
    left, right = (
        counts * math.sqrt(PULSE_VARIANCE / (PULSE_VARIANCE + params.encoder.pulse_variance(counts)))
        for counts in (params.counts_per_turn.left, params.counts_per_turn.right)
    )
    return left if left == right else math.sqrt(2.0 / (left**-2 + right**-2))


def recommended(
    candidates: Sequence[Candidate], answer: Answer, tests: Sequence[DriveDraws], requirement: Requirement
) -> Optional[Candidate]:
    """Return the smallest candidate whose odometry certainly meets a requirement; None if no candidate does.

    The candidates are in ascending quality, and the answer is for counts of the robot's encoder.
    """
    if answer.kind is not Kind.FROM:
        return None
    too_few = answer.interval[0] or 0.0
    for candidate in candidates:
        # Real encoders have errors: their equivalent counts do not exclude them.
        if candidate.counts <= too_few and candidate.label == f'{candidate.counts:g}':
            continue
        is_possible = _worst(tests, candidate.params, FEW_DRAWS, requirement).high >= requirement.share
        if is_possible and _worst(tests, candidate.params, DRAWS, requirement).low >= requirement.share:
            return candidate
    return None


def _worst(tests: Sequence[DriveDraws], params: EncoderParams, count: int, requirement: Requirement) -> Interval:
    """Return the success rate of odometry in the worst test."""
    return min(share_within(draws.errors([params], count)[0], requirement) for draws in tests)


def finest_real(candidates: Sequence[Candidate], answer: Answer) -> Optional[Candidate]:
    """Return the finest real encoder whose counts suffice, or None; if not `recommended`, its errors are too large."""
    enough = answer.interval[1] or 0.0
    real = (each for each in reversed(candidates) if each.params.encoder.counts_per_wheel_turn is not None)
    return next((each for each in real if each.params.counts_per_turn.left >= enough), None)


class ListedEncoder(NamedTuple):
    """Encoder on the wheels of this robot."""

    name: str
    real: Optional[EncoderFileParams]  # None of a robot's own
    ppr: float  # counts per revolution of the wheel
    equivalent_ppr: float  # of the equivalent ideal encoder
    odometry_share: Interval  # success rate in the worst test
    meets: Dict[Criterion, Optional[bool]]  # None: unknown
    limit: Sequence[Limit] = ()  # encoder errors that are too large for odometry

    @property
    def is_of_robot(self) -> bool:
        """Return whether the encoder is not sold without a robot."""
        return self.real is None or self.real.price == OF_ROBOT

    @property
    def share_text(self) -> str:
        """Return the interval in per cent."""
        return f'{100.0 * self.odometry_share.low:.0f}–{100.0 * self.odometry_share.high:.0f} %'


def listed_encoders(
    tests: Sequence[DriveDraws],
    config_folder: Path,
    requirement: Requirement,
    answers: Mapping[Criterion, Answer],
    candidates: Sequence[Candidate] = (),
) -> List[ListedEncoder]:
    """Return the encoders of config/encoders and config/robots, and candidates with a name.

    Those that are sold come before those of robots, both by ascending counts.

    Odometry is sampled with the errors of each encoder. For the pose at the goal, where localization corrects drift, an
    encoder counts as the ideal one with equal variance of a reading.
    """
    catalogue = load_encoders([WHOLE_CATALOGUE], config_folder, Path())
    known: Dict[str, Tuple[Optional[EncoderFileParams], EncoderParams]] = {
        each.name: (each.real, each.params) for each in catalogue if each.params
    }
    for robot in robot_names(config_folder):
        ppr = load_robot_file(robot, Path(), config_folder.parent, {}).ppr
        if ppr is not None and robot not in known:
            known[f'own of {robot}'] = None, EncoderParams(ppr=PerWheel(left=ppr, right=ppr))
    known.update({each.name: (each.real, each.params) for each in candidates if each.name})
    found = []
    for name, (real, params) in known.items():
        share, like = _worst(tests, params, LISTED_DRAWS, requirement), equivalent_counts(params)
        meets = {Criterion.ODOMETRY: _met(share, requirement)}
        # The variance of a reading does not contain faults.
        loses_counts = params.encoder.faults.model_copy(update={'max_count_rate': 0.0}) != NO_FAULTS
        for criterion in (Criterion.POSE_ESTIMATE, Criterion.TRUTH):
            meets[criterion] = None if loses_counts else _by_counts(like, answers.get(criterion))
        own: List[Limit] = []
        if meets[Criterion.ODOMETRY] is False:  # by its own errors if its counts suffice
            ideal = odometry_answer.ideal_of(params)
            is_enough = _worst(tests, ideal, LISTED_DRAWS, requirement).low >= requirement.share
            own = odometry_answer.own_limits(tests, params, requirement, is_enough, LISTED_DRAWS)
        found.append(ListedEncoder(name, real, params.counts_per_turn.left, like, share, meets, own))
    return sorted(found, key=lambda encoder: (encoder.is_of_robot, encoder.ppr, encoder.name))


def _met(share: Interval, requirement: Requirement) -> Optional[bool]:
    if share.low >= requirement.share:
        return True
    return False if share.high < requirement.share else None


def _by_counts(counts: float, answer: Optional[Answer]) -> Optional[bool]:
    """Return whether the counts suffice; None inside the interval of the answer."""
    if answer is None or answer.kind is Kind.UNDECIDED:
        return None
    not_enough, enough = answer.interval
    if answer.kind is Kind.FROM and enough is not None and counts >= enough:
        return True
    is_too_few = not_enough is not None and counts <= not_enough
    return False if is_too_few or answer.kind is Kind.NOT_THE_LIMIT else None


class TriedEncoder(NamedTuple):
    """Closed-loop trials of one test with one encoder."""

    test: str
    encoder: str  # label
    ppr: float  # of the equivalent ideal encoder
    within: Dict[Criterion, TrialCounts]
    budget: Optional[Budget]  # of the true pose, in trials that reached the goal with all encoders; None if too few
    budgeted: int  # number of these trials


class Advice(NamedTuple):
    """Results of an advice; without trials, only of odometry."""

    robot: str
    own_counts: Optional[float]  # of the robot's own encoder, per revolution of the wheel
    requirement: Requirement
    curves: OdometryCurves
    geometry: RobotGeometry  # that odometry assumes
    shown_wheels: Sequence[WheelQuality]  # or ROBOT_FILE; the first is that of `answers`
    answers: Dict[Criterion, Answer]
    by_wheels: Dict[WheelQuality, Answer]  # of odometry
    budgets: Dict[str, Dict[float, Budget]]  # error budgets of odometry, by test and counts
    stopping: Dict[str, Dict[str, StopSpread]]  # upper bounds in closed form, by encoder and cause
    tried: Sequence[TriedEncoder] = ()
    encoders: Sequence[ListedEncoder] = ()
    curves_by_wheels: Sequence[OdometryCurves] = ()  # of the shown wheels
    imus: Sequence[ImuAnswer] = ()  # by shown wheels, then by IMU

    @property
    def closed_form(self) -> Dict[str, float]:
        """Return, by test, the lowest counts at which quantisation errors meet the requirement."""
        drives = (curve.draws.drive for curve in self.curves.curves)
        return {drive.test: closed_form_counts(drive.requested, self.geometry, self.requirement) for drive in drives}


BUDGET_COUNTS = tuple(float(2**exponent) for exponent in range(6, 15))  # resolutions with a budget


TestsByWheels = Dict[WheelQuality, List[DriveDraws]]


class AdvisedRobot(NamedTuple):
    """Robot that needs an encoder, and its drives."""

    name: str
    own_counts: Optional[float]  # of its own encoder, per revolution of the wheel
    tests: List[DriveDraws]
    encoder: EncoderParams  # whose counts are replaced
    candidates: List[Candidate]
    file: str = ''  # robot file

    def by_wheels(self) -> TestsByWheels:
        """Return the drives by quality of the wheels, those of a robot file with errors first."""
        own = self.tests[0].robot
        robots = {own.own_quality: own, **{each: own.with_quality(each) for each in QUALITIES.values()}}
        exact = [draws.of(robots[EXACT]) for draws in self.tests]
        return {key: [each.of(robot, each) for each in exact] for key, robot in robots.items()}


def simulated_robot(campaign: Campaign, distance_m: Optional[float]) -> AdvisedRobot:
    """Simulate one drive of each of a campaign's tests, or a straight line of `distance_m`.

    The parameters of the campaign's first encoder, except the counts, are those of the robot. ConfigError if a file is
    invalid, or the robot does not reach a goal.
    """
    first = campaign.cells[0].robot_params
    first_trials: Dict[str, RequestedTrial] = {}  # by test
    for job in campaign.trials():
        first_trials.setdefault(job.cell.test.name, job)
    with tempfile.TemporaryDirectory() as folder:
        files = campaign.files.materialise(folder)
        source = RobotSource(files.robot)
        robot = drive_draws.drawn_robot(source, first, campaign.robot.file.calibration)
        if distance_m is not None:
            straight = drive_draws.test_of(Segment(straight=distance_m), next(iter(first_trials.values())).cell.test)
            drives = [drive_draws.scripted(straight, source, first)]
        else:
            drives = [
                drive_draws.scripted(job.cell.test, source, job.cell.robot_params)
                if job.cell.test.drive  # needs no navigation
                else drive_draws.navigated(
                    TrialPlan(trial=job.definition(), bag='', **files.worlds[test]), source, job.cell.robot_params
                )
                for test, job in first_trials.items()
            ]
    tests = [DriveDraws(drive, robot, campaign.params.seed) for drive in drives]
    name, file = campaign.robot.name, campaign.robot.file
    return AdvisedRobot(name, file.ppr, tests, first.encoder, candidates_of(campaign), file.where)


def study_odometry(robot: AdvisedRobot, tests: TestsByWheels, requirement: Requirement, wheels: str = '') -> Advice:
    """Find the counts and the candidate that suffice for odometry on the shown wheels; '' shows two kinds."""
    default = next(iter(tests))
    shown = [QUALITIES[wheels]] if wheels else [default, CALIBRATED if default == EXACT else EXACT]
    studied = {each: _curves_and_answer(robot, tests[each], requirement, True) for each in shown}
    by_wheels = {quality: answer for quality, (_, answer) in studied.items()}
    left_m, right_m, separation_m = robot.tests[0].robot.assumed.tolist()
    geometry, odometry = RobotGeometry(left_m + right_m, separation_m), {Criterion.ODOMETRY: by_wheels[shown[0]]}
    about = robot.name, robot.own_counts, requirement, studied[shown[0]][0], geometry
    return Advice(
        *about, shown, odometry, by_wheels, {}, {}, curves_by_wheels=[curves for curves, _ in studied.values()]
    )


def with_all_wheels(advice: Advice, robot: AdvisedRobot, tests: TestsByWheels) -> Advice:
    """Return the advice with the answers for the wheels that are not shown."""
    known = advice.by_wheels
    answers = {
        each: known.get(each) or _curves_and_answer(robot, of_wheels, advice.requirement, False)[1]
        for each, of_wheels in tests.items()
    }
    return advice._replace(by_wheels=answers)


USUAL_COUNTS = 90.0  # of the answers for IMUs, of a robot without an encoder


def with_imus(advice: Advice, imus: Mapping[str, ImuParams], rate_hz: float, ppr: Sequence[float]) -> Advice:
    """Return the advice with answers by IMU, also at the counts `ppr`; the first has budgets, on imperfect wheels."""
    counts, found, requirement = [*ppr] or [advice.own_counts or USUAL_COUNTS], [], advice.requirement
    budgeted = max(advice.shown_wheels, key=lambda each: each != EXACT), next(iter(imus))
    for wheels, curves in zip(advice.shown_wheels, advice.curves_by_wheels):
        for name, imu in imus.items():
            found.append(
                imu_answer(name, imu, wheels, curves, requirement, rate_hz, counts, (wheels, name) == budgeted)
            )
    return advice._replace(imus=found)


def _curves_and_answer(
    robot: AdvisedRobot, tests: List[DriveDraws], requirement: Requirement, has_limits: bool
) -> Tuple[OdometryCurves, Answer]:
    """Return the curves and the answer; `has_limits` names errors of real encoders, unless the wheels are the limit."""
    candidates, params = robot.candidates, robot.encoder
    if params.encoder.counts_per_wheel_turn is not None:  # so that ppr sets the counts
        params = params.model_copy(update={'encoder': IDEAL_ENCODER})
    curves = OdometryCurves(tests, params)
    answer = odometry_answer.odometry_answer(curves, requirement)
    chosen = recommended(candidates, answer, tests, requirement)
    if chosen:
        answer = answer._replace(encoder=chosen.label)
    elif answer.kind is not Kind.UNDECIDED and not answer.reach:
        real = finest_real(candidates, answer) if has_limits else None
        limited = real and odometry_answer.limited_answer(tests, real.params, requirement)
        if real and limited and any(limit.cause in odometry_answer.ENCODER_CAUSES for limit in limited.limits):
            curves = OdometryCurves(tests, odometry_answer.counts_by_ppr(real.params))
            answer = limited._replace(errors_of=real.label)
        elif answer.kind is Kind.FROM:
            answer = answer._replace(note='no candidate suffices')
    return curves, answer


def with_budgets(advice: Advice, counts_per_turn: Sequence[float] = BUDGET_COUNTS) -> Advice:
    """Return the advice with odometry budgets at these counts; with several, also at those of the answer."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts
    counts = advice.curves.whole([*counts_per_turn, *([wanted] if wanted and len(counts_per_turn) > 1 else [])])
    encoders = [advice.curves.encoder(each) for each in counts]
    budgets = {curve.test: dict(zip(counts, odometry_budgets(curve.draws, encoders))) for curve in advice.curves.curves}
    return advice._replace(budgets=budgets)
