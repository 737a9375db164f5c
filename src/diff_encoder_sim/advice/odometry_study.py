"""Results of an advice, and its odometry part: one drive per test, its curve, budget and answer."""

from __future__ import annotations

import tempfile
from typing import Dict, List, NamedTuple, Optional

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.answers import Answer, Budget, Criterion, Kind, Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.encoder_search import TrialCounts
from diff_encoder_sim.advice.listed_encoders import ListedEncoder, candidates_of, finest_real, recommended
from diff_encoder_sim.advice.odometry_answer import (
    ENCODER_CAUSES,
    OdometryCurves,
    closed_form_counts,
    counts_by_ppr,
    limited_answer,
    odometry_answer,
    odometry_budgets,
)
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER


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
    answers: Dict[Criterion, Answer]
    budgets: Dict[str, Dict[float, Budget]]  # error budgets of odometry, by test and counts
    stopping: Dict[str, Dict[str, StopSpread]]  # upper bounds in closed form, by encoder and cause
    tried: List[TriedEncoder]
    encoders: List[ListedEncoder]

    @property
    def closed_form(self) -> Dict[str, float]:
        """Return, by test, the lowest counts at which quantisation errors meet the requirement."""
        drives = (curve.draws.drive for curve in self.curves.curves)
        return {drive.test: closed_form_counts(drive.requested, self.geometry, self.requirement) for drive in drives}


# Resolutions with a budget, in counts per revolution.
BUDGET_COUNTS = tuple(float(2**exponent) for exponent in range(6, 15))


def study_odometry(campaign: Campaign, requirement: Requirement, distance_m: Optional[float]) -> Advice:
    """Sample the odometry of a campaign's tests, or of a straight line.

    Args:
        campaign: the parameters of its first encoder, except the counts, are those of the robot.
        requirement: at the end of each drive.
        distance_m: length of a straight line that replaces the tests.

    Raises:
        ConfigError: a file is invalid, or the robot does not reach a goal.
    """
    first = campaign.cells[0].robot_params
    params = first.encoder
    if params.encoder.counts_per_wheel_turn is not None:  # so that ppr sets the counts
        params = params.model_copy(update={'encoder': IDEAL_ENCODER})
    first_trials: Dict[str, RequestedTrial] = {}  # by test
    for job in campaign.trials():
        first_trials.setdefault(job.cell.test.name, job)
    with tempfile.TemporaryDirectory() as folder:
        files = campaign.files.materialise(folder)
        source = RobotSource(files.robot)
        robot = drive_draws.drawn_robot(source, first)
        if distance_m is not None:
            straight = drive_draws.straight_test(distance_m, next(iter(first_trials.values())).cell.test)
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
    curves = OdometryCurves(tests, params)
    answer, candidates = odometry_answer(curves, requirement), candidates_of(campaign)
    chosen = recommended(candidates, answer, tests, requirement)
    if chosen:
        answer = answer._replace(encoder=chosen.label)
    elif answer.kind is not Kind.UNDECIDED:
        real = finest_real(candidates, answer)
        limited = real and limited_answer(tests, real.params, requirement)
        if real and limited and any(limit.cause in ENCODER_CAUSES for limit in limited.limits):
            curves = OdometryCurves(tests, counts_by_ppr(real.params))
            answer = limited._replace(errors_of=real.label)
        elif answer.kind is Kind.FROM:
            answer = answer._replace(note='no candidate suffices')
    name, own = campaign.robot.name, campaign.robot.file.ppr
    geometry = RobotGeometry(first.odometry.wheel_diameter, first.odometry.wheel_separation)
    return Advice(name, own, requirement, curves, geometry, {Criterion.ODOMETRY: answer}, {}, {}, [], [])


def with_budgets(advice: Advice) -> Advice:
    """Return the advice with odometry budgets over the range of encoders and for the answer's encoder."""
    wanted = advice.answers[Criterion.ODOMETRY].budgeted_counts
    counts = advice.curves.whole([*BUDGET_COUNTS, *([wanted] if wanted else [])])
    encoders = [advice.curves.encoder(each) for each in counts]
    budgets = {curve.test: dict(zip(counts, odometry_budgets(curve.draws, encoders))) for curve in advice.curves.curves}
    return advice._replace(budgets=budgets)
