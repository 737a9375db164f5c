"""Closed-loop answers of synthetic trials, their errors and causes."""

import math

import numpy as np
import pytest

from advised_robots import straight_advice
from diff_encoder_sim.advice import trial_study
from diff_encoder_sim.advice.answers import Criterion, Kind, Requirement
from diff_encoder_sim.advice.odometry_answer import SENSOR_ERRORS, UNEVEN_LINES
from diff_encoder_sim.advice.trial_study import AS_IT_IS, WITHOUT_ALL, truth_budget
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from places import ROOT
from trial_tables import results_of
from trial_tables import trial as row

PPR = [20.0, 28.0, 40.0, 60.0, 90.0, 180.0, 256.0, 360.0, 512.0, 4096.0]


@pytest.fixture(scope='module')
def campaign():
    return load_campaign('sweep', package_folder(), {'tests': ['SL'], 'ppr': PPR, 'trials': 60})


class Trials:
    """Trials of SL: the stop spreads, localization is off by what map and encoder add, odometry is as drawn."""

    def __init__(self, encoder_m=0.0, stop_m=0.002, map_m=0.0, odometry_m=None, count=39):
        self.run, self._count = [], count
        self._encoder_m, self._stop_m, self._map_m, self._odometry_m = encoder_m, stop_m, map_m, odometry_m

    def __call__(self, label, variant):
        assert variant == '' and label not in self.run, 'each candidate is run once'
        self.run.append(label)
        return results_of([self._trial(label, number) for number in range(1, self._count + 1)]).trials

    def _trial(self, label, number):
        stop, encoder = np.random.default_rng(number).normal(size=2)
        estimate_m = self._stop_m * stop
        truth_m = estimate_m + self._map_m + self._encoder_m / float(label) * encoder
        # A triangle from -w to w, w = S d / L.
        drawn_m = np.diff(np.random.default_rng(number).random(2))[0] * 20.0 * math.pi * 0.2 / float(label) / 0.4
        odometry_m = truth_m + (drawn_m if self._odometry_m is None else self._odometry_m)
        errors_m = {'global': estimate_m, 'world': truth_m, 'odom': odometry_m}
        return row('SL', label, number, **{pose: (0.0, error_m, 0.0) for pose, error_m in errors_m.items()})


def study(campaign, trials):
    return trial_study.study_trials(campaign, straight_advice(), trials)


def test_the_smallest_sufficient_encoder_is_found_and_tried_with_the_one_below(campaign):
    trials = Trials(encoder_m=1.5)  # 37 mm at 40 PPR, 25 mm at 60
    answers = study(campaign, trials).answers
    answer, odometry = answers[Criterion.TRUTH], answers[Criterion.ODOMETRY]
    assert answers[Criterion.POSE_ESTIMATE].counts == 20.0  # the encoder spoils only the truth in these trials
    assert odometry.encoder == '360' and odometry.note == '' and '360' in trials.run
    assert answer.kind is Kind.FROM and answer.encoder in ('60', '90')
    assert answer.interval[1] == answer.counts == float(answer.encoder)
    rank = PPR.index(answer.counts)
    assert {f'{ppr:g}' for ppr in PPR[rank - 1 : rank + 1]} <= set(trials.run)
    assert '4096' in trials.run  # whether any encoder does


def test_a_map_that_is_wrong_is_named_as_the_limit_with_what_would_do(campaign):
    answer = study(campaign, Trials(map_m=0.06)).answers[Criterion.TRUTH]
    assert answer.kind is Kind.NOT_THE_LIMIT
    (limit,) = answer.limits
    assert (limit.cause, limit.test, limit.axis) == ('localization', 'SL', 'across')
    assert limit.error == pytest.approx(0.06, abs=0.005)
    assert str(answer).startswith('the encoder is not the limit: localization makes ')
    assert answer.counts is not None and answer.encoder


@pytest.mark.parametrize('every', [1, 2])
def test_trials_that_do_not_come_to_the_goal_are_what_limits(campaign, every):
    class Failing(Trials):
        def _trial(self, label, number):
            trial = super()._trial(label, number)
            return trial if number % every else {**trial, 'outcome': 'collision', 'reason': 'touches wall'}

    answer = study(campaign, Failing()).answers[Criterion.TRUTH]
    assert answer.kind is Kind.NOT_THE_LIMIT and answer.limits == []
    assert 'trials of SL do not come to the goal (collision: touches wall)' in str(answer)


def test_too_few_trials_leave_it_undecided_and_say_how_many_more(campaign):
    answer = study(campaign, Trials(count=15)).answers[Criterion.TRUTH]
    assert answer.kind is Kind.UNDECIDED and answer.more_trials > 5  # 21 without a failure decide


def test_trials_that_disagree_with_the_draws_are_spoken_of(campaign):
    answer = study(campaign, Trials(odometry_m=0.2)).answers[Criterion.ODOMETRY]
    assert 'sampled drives predict' in answer.note and answer.note in str(answer)


def goal_trials_of(rows):
    return trial_study.goal_trials(results_of(rows).trials, Pose2D(10.0, 0.0, 0.0))


def trials_of(count, encoder_m=0.0):
    """Trials whose stop spreads by 3 mm along, and localization by 2 mm and `encoder_m` across."""
    stop, fix, encoder = np.random.default_rng(1).normal(size=(3, count)) * [[0.003], [0.002], [encoder_m]]
    return [
        row('SL', '90', number, **{'global': (x_m, 0.0, 0.0)}, world=(x_m, y_m, 0.0), odom=(0.0, 0.0, 0.0))
        for number, x_m, y_m in zip(range(1, count + 1), stop, 0.001 + fix + encoder)
    ]


def test_each_criterion_has_its_error_and_an_aborted_trial_only_that_of_odometry():
    poses = {'global': (0.01, 0.0, 0.0), 'world': (0.06, 0.0, 0.0), 'odom': (0.1, 0.0, 0.0)}
    endings = enumerate(('succeeded', 'lost'), start=1)
    trials = [row('SL', '90', number, outcome, **poses) for number, outcome in endings]
    ends = goal_trials_of([*trials, row('SL', '90', 3, 'lost')])
    within = {criterion: ends.counts(criterion, Requirement()).within for criterion in Criterion}
    assert within == {Criterion.ODOMETRY: 2, Criterion.POSE_ESTIMATE: 1, Criterion.TRUTH: 0}
    assert ends.known_numbers.tolist() == [1]


def test_a_budget_has_the_encoders_part_and_that_of_each_cause_and_adds_up():
    ends, finest = (goal_trials_of(trials_of(2000, encoder_m)) for encoder_m in (0.01, 0.0))
    budget, count = truth_budget(ends, finest, finest, {'wheel slip': finest})
    assert count == 2000
    assert budget.parts[trial_study.STOPPING].std[0] == pytest.approx(0.003, rel=0.1)
    assert budget.parts[trial_study.LOCALIZATION].bias[1] == pytest.approx(0.001, abs=2e-4)
    assert budget.parts[trial_study.ENCODER].std[1] == budget.parts['wheel slip'].std[1] == pytest.approx(0.01, rel=0.1)
    total = sum(part.variance for part in budget.parts.values()) + budget.rest.variance
    np.testing.assert_allclose(total, budget.found.variance)


def test_a_budget_pairs_trials_and_needs_some():
    ends, others = (goal_trials_of(rows) for rows in (trials_of(20), trials_of(40)[13:]))
    assert truth_budget(ends, ends, others, {}) == (None, 7)


def test_each_cause_is_switched_off_by_itself_and_all_at_once():
    given = {
        'simulator.wheel_errors.left_slip': 0.01,
        'simulator.wheel_errors.radius_spread': 0.01,
        'simulator.wheel_errors.wheel_separation_error': 0.02,
        'config.encoder.hysteresis': 1.0,
        'config.encoder.faults.max_count_rate': 1000.0,
    }
    config = load_robot_config(ROOT / 'config')
    found = trial_study.switched_off([override(config, given)])
    causes = ['wheel radius', 'wheel separation', 'wheel slip', 'edge errors', 'missed counts']
    assert list(found) == [AS_IT_IS, *(f'without {cause}' for cause in causes), WITHOUT_ALL]
    assert found[AS_IT_IS] == {} == trial_study.switched_off([override(config, {})])
    assert found['without wheel slip']['simulator.wheel_errors.left_slip'] == 0.0
    assert 'config.encoder.hysteresis' not in found['without wheel slip']
    assert override(config, {**given, **found[WITHOUT_ALL]}) == override(config, {})


def test_all_errors_of_an_encoder_belong_to_a_cause():
    """The other fields select the encoder."""
    known = {*SENSOR_ERRORS, *UNEVEN_LINES, 'faults'}
    kinds = {'sensor', 'lines', 'decoding', 'pole_pairs', 'bits', 'side', 'gear_ratio', 'direction'}
    assert set(EncoderModel.model_fields) == known | kinds
