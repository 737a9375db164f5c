"""ALTO's odometry after a straight line without a simulator, and an advice of it."""

import functools
import math

import numpy as np

from diff_encoder_sim.advice import odometry_curve
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Requirement
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.encoder_search import TrialCounts
from diff_encoder_sim.advice.listed_encoders import ListedEncoder
from diff_encoder_sim.advice.odometry_answer import odometry_answer
from diff_encoder_sim.advice.odometry_curve import OdometryCurves
from diff_encoder_sim.advice.odometry_study import Advice, TriedEncoder, with_budgets
from diff_encoder_sim.advice.trial_study import GoalTrials, truth_budget
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from drawn_drives import line, robot_of
from trial_tables import ALTO

REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)
STOP = StopSpread(0.005, 0.01)
DRAWS = 120  # of each point of a curve


def straight(length_m=20.0):
    """SL without slip."""
    return line(length_m, name='SL')


def alto(**wheel_errors):
    return robot_of(stop=STOP, **wheel_errors)


def advice_of(*drives, requirement=REQUIREMENT, draws=DRAWS, **wheel_errors):
    """An advice without trials, budgets and encoders, by few draws."""
    params = EncoderParams()
    kept = odometry_curve.DRAWS, odometry_curve.FINE_DRAWS
    odometry_curve.DRAWS, odometry_curve.FINE_DRAWS = min(draws, 500), draws
    try:
        tests = [DriveDraws(drive, alto(**wheel_errors), 1) for drive in drives or [straight()]]
        curves = OdometryCurves(tests, params)
        answers = {Criterion.ODOMETRY: odometry_answer(curves, requirement)}
    finally:
        odometry_curve.DRAWS, odometry_curve.FINE_DRAWS = kept
    return Advice('alto', 90.0, requirement, curves, ALTO, answers, {}, {}, [], [])


@functools.lru_cache(maxsize=None)
def straight_advice():
    """The same once for all tests."""
    advice = advice_of(draws=2000)
    answer = advice.answers[Criterion.ODOMETRY]._replace(encoder='360')
    return advice._replace(answers={Criterion.ODOMETRY: answer})


@functools.lru_cache(maxsize=None)
def whole_advice():
    """An advice with all that there can be."""
    tried = [
        TriedEncoder('SL', label, float(label), dict.fromkeys(Criterion, TrialCounts(within, 17)), budget, 17)
        for label, within, budget in (('28', 12, None), ('40', 17, _truth_budget()))
    ]
    advice = with_budgets(straight_advice())
    answers = {
        **advice.answers,
        Criterion.POSE_ESTIMATE: Answer(Criterion.POSE_ESTIMATE, Kind.UNDECIDED, more_trials=12),
        Criterion.TRUTH: Answer(Criterion.TRUTH, Kind.FROM, 40.0, (28.0, 40.0), '40'),
    }
    encoders = [
        ListedEncoder('amt102', 'industrial low', 8192.0, 586.8, Interval(0.98, 1.0), dict.fromkeys(Criterion, True)),
        ListedEncoder(
            'own of alto', '', 90.0, 90.0, Interval(0.1, 0.2), {**dict.fromkeys(Criterion), Criterion.ODOMETRY: False}
        ),
    ]
    stopping = {'40': {'coasting': STOP}}
    return advice._replace(tried=tried, answers=answers, encoders=encoders, stopping=stopping)


def _truth_budget():
    rng = np.random.default_rng(1)
    stop, fix = rng.normal(0.0, 0.002, (17, 3)), rng.normal(0.001, 0.003, (17, 3))
    ends = GoalTrials(Pose2D(20.0, 0.0, 0.0), np.arange(17), np.ones(17, bool), stop, stop + fix, stop + fix)
    return truth_budget(ends, ends, ends, {})[0]
