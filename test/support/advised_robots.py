"""ALTO's odometry after a straight line without a simulator, and an advice of it."""

import functools

import numpy as np
import pytest

from diff_encoder_sim.advice import imu_answer
from diff_encoder_sim.advice import odometry_answer as module
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Limit, Reach, Requirement, Travel
from diff_encoder_sim.advice.drive_draws import RADIUS, DriveDraws
from diff_encoder_sim.advice.encoder_search import TrialCounts
from diff_encoder_sim.advice.odometry_answer import OdometryCurves, odometry_answer
from diff_encoder_sim.advice.odometry_study import Advice, ListedEncoder, TriedEncoder, with_budgets, with_imus
from diff_encoder_sim.advice.trial_study import GoalTrials, truth_budget
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.base.imu import load_imu
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.wheel_quality import CALIBRATED, EXACT
from diff_encoder_sim.wheels.catalogue import load_encoder
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from drawn_drives import line, robot_of
from places import ROOT
from trial_tables import ALTO

REQUIREMENT = Requirement()
STOP = StopSpread(0.005, 0.01)
LIMIT = Limit(RADIUS, 'SL', 'across', 0.64, 0.05, 0.025)
REACH = Reach('SL', 'across', 0.64, 0.05, Travel(20.0, 0.0), Travel(5.59, 0.0))
LIMITED = Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, 389.0, limits=[LIMIT], reach=REACH)  # calibrated wheels


def straight():
    """ALTO's draws of SL without slip."""
    return DriveDraws(line(name='SL'), robot_of(stop=STOP), 1)


@functools.lru_cache(maxsize=None)
def straight_advice():
    """An advice without trials, budgets and encoders, by few draws; the same once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'DRAWS', 500)
        patch.setattr(module, 'FINE_DRAWS', 2000)
        curves = OdometryCurves([straight()], EncoderParams())
        answer = odometry_answer(curves, REQUIREMENT)._replace(encoder='360')
    by_wheels = {EXACT: answer, CALIBRATED: LIMITED}
    about = 'alto', 90.0, REQUIREMENT, curves, ALTO
    return Advice(*about, [*by_wheels], {Criterion.ODOMETRY: answer}, by_wheels, {}, {})


@functools.lru_cache(maxsize=None)
def advice_with_imus():
    """An advice on exact wheels with two IMUs, of which the first has budgets."""
    advice = straight_advice()
    advice = advice._replace(shown_wheels=[EXACT], curves_by_wheels=[advice.curves])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(imu_answer, 'MOST_DRAWS', 50)
        imus = {name: load_imu(name, ROOT / 'config', ROOT).imu for name in ('stim300', 'bno055')}
        return with_imus(with_budgets(advice, [128.0]), imus, 20.0, [90.0])


@functools.lru_cache(maxsize=None)
def whole_advice():
    """An advice with all that there can be."""
    rng = np.random.default_rng(1)
    stop, fix = rng.normal(0.0, 0.002, (17, 3)), rng.normal(0.001, 0.003, (17, 3))
    ends = GoalTrials(Pose2D(20.0, 0.0, 0.0), np.arange(17), np.ones(17, bool), stop, stop + fix, stop + fix)
    budget, _ = truth_budget(ends, ends, ends, {})
    tried = [
        TriedEncoder('SL', label, float(label), dict.fromkeys(Criterion, TrialCounts(within, 17)), budget, 17)
        for label, within, budget in (('28', 12, None), ('40', 17, budget))
    ]
    advice = with_budgets(straight_advice())
    answers = {
        **advice.answers,
        Criterion.POSE_ESTIMATE: Answer(Criterion.POSE_ESTIMATE, Kind.UNDECIDED, more_trials=12),
        Criterion.TRUTH: Answer(Criterion.TRUTH, Kind.FROM, 40.0, (28.0, 40.0), '40'),
    }
    meets = dict.fromkeys(Criterion, True), {**dict.fromkeys(Criterion), Criterion.ODOMETRY: False}
    amt102 = load_encoder('amt102', ROOT / 'config', ROOT).real
    encoders = [
        ListedEncoder('amt102', amt102, 8192.0, 586.8, Interval(0.98, 1.0), meets[0]),
        ListedEncoder('own of alto', None, 90.0, 90.0, Interval(0.1, 0.2), meets[1]),
    ]
    stopping = {'40': {'coasting': STOP}}
    return advice._replace(tried=tried, answers=answers, encoders=encoders, stopping=stopping)
