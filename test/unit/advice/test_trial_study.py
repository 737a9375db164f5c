"""Closed-loop answers of synthetic trials."""

import math

import numpy as np
import pytest

from advised_robots import straight_advice
from diff_encoder_sim.advice.answers import Criterion, Kind
from diff_encoder_sim.advice.trial_study import CONFIRMING, TrialStudy
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_loading import load_campaign
from synthetic_trials import trial_data

PPR = [20.0, 28.0, 40.0, 60.0, 90.0, 180.0, 256.0, 360.0, 512.0, 4096.0]


@pytest.fixture(scope='module')
def campaign():
    return load_campaign('sweep', package_folder(), {'tests': ['SL'], 'ppr': PPR, 'trials': 60})


class Trials:
    """Trials of SL: the stop spreads, localization is off by what map and encoder add, odometry is as drawn."""

    def __init__(self, encoder_m=0.0, stop_m=0.002, map_m=0.0, odometry_m=None):
        self.run = {}
        self._encoder_m, self._stop_m, self._map_m, self._odometry_m = encoder_m, stop_m, map_m, odometry_m

    def __call__(self, label, count, variant):
        assert variant == ''
        self.run[label] = max(count, self.run.get(label, 0))
        return [self._trial(label, number) for number in range(1, count + 1)]

    def _trial(self, label, number):
        stop, encoder = np.random.default_rng(number).normal(size=2)
        estimate_m = self._stop_m * stop
        truth_m = estimate_m + self._map_m + self._encoder_m / float(label) * encoder
        # A triangle from -w to w, w = S d / L.
        drawn_m = np.diff(np.random.default_rng(number).random(2))[0] * 20.0 * math.pi * 0.2 / float(label) / 0.4
        odometry_m = truth_m + (drawn_m if self._odometry_m is None else self._odometry_m)
        errors = {PoseSource.GLOBAL: estimate_m, PoseSource.WORLD: truth_m, PoseSource.ODOM: odometry_m}
        poses = {source: Pose2D(0.0, error_m, 0.0) for source, error_m in errors.items()}
        return trial_data('SL', label, number)._replace(errors=poses)


def study(campaign, trials, most=60):
    return TrialStudy(campaign, straight_advice(), trials, most).advice()


def test_the_smallest_sufficient_encoder_is_found_and_tried_with_its_neighbours(campaign):
    trials = Trials(encoder_m=1.5)  # 37 mm at 40 PPR, 25 mm at 60
    answer = study(campaign, trials).answers[Criterion.TRUTH]
    assert answer.kind is Kind.FROM and answer.encoder in ('60', '90')
    assert answer.interval[1] == answer.counts == float(answer.encoder)
    rank = PPR.index(answer.counts)
    assert {f'{ppr:g}' for ppr in PPR[rank - 1 : rank + 2]} <= set(trials.run)
    assert '4096' in trials.run  # whether any encoder does


def test_the_pose_estimate_has_an_answer_of_its_own(campaign):
    answers = study(campaign, Trials(encoder_m=1.5)).answers
    assert answers[Criterion.POSE_ESTIMATE].counts == 20.0  # the encoder spoils the truth alone, in these trials


def test_a_map_that_is_wrong_is_named_as_the_limit_with_what_would_do(campaign):
    answer = study(campaign, Trials(map_m=0.06)).answers[Criterion.TRUTH]
    assert answer.kind is Kind.NOT_THE_LIMIT
    (limit,) = answer.limits
    assert (limit.cause, limit.test, limit.axis) == ('localization', 'SL', 1)
    assert limit.error == pytest.approx(0.06, abs=0.005)
    assert str(answer).startswith('the encoder is not the limit: localization makes ')
    assert answer.counts is not None and answer.encoder


@pytest.mark.parametrize('every', [1, 2])
def test_trials_that_do_not_come_to_the_goal_are_what_limits(campaign, every):
    class Failing(Trials):
        def _trial(self, label, number):
            trial = super()._trial(label, number)
            return trial if number % every else trial._replace(outcome=Outcome.COLLISION, reason='touches wall')

    answer = study(campaign, Failing()).answers[Criterion.TRUTH]
    assert answer.kind is Kind.NOT_THE_LIMIT and answer.limits == []
    assert 'trials of SL do not come to the goal (collision: touches wall)' in str(answer)


def test_too_few_trials_leave_it_undecided_and_say_how_many_more(campaign):
    answer = study(campaign, Trials(), most=5).answers[Criterion.TRUTH]
    assert answer.kind is Kind.UNDECIDED
    assert answer.more_trials >= 10


def test_the_odometrys_encoder_is_tried_with_its_neighbours(campaign):
    trials = Trials()
    answer = study(campaign, trials).answers[Criterion.ODOMETRY]
    assert answer.encoder == '360' and answer.note == ''
    assert all(trials.run[label] >= CONFIRMING for label in ('256', '360', '512'))


def test_trials_that_disagree_with_the_draws_are_spoken_of(campaign):
    answer = study(campaign, Trials(odometry_m=0.2)).answers[Criterion.ODOMETRY]
    assert 'where the draws let expect' in answer.note and answer.note in str(answer)
