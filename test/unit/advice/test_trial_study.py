"""Closed-loop answers of synthetic trials, their errors and causes."""

import math

import numpy as np
import pytest

from advised_robots import straight_advice
from diff_encoder_sim.advice.answers import Criterion, Kind, Requirement
from diff_encoder_sim.advice.odometry_answer import SENSOR_ERRORS, UNEVEN_LINES
from diff_encoder_sim.advice.trial_study import (
    AS_IT_IS,
    ENCODER,
    LOCALIZATION,
    STOPPING,
    WITHOUT_ALL,
    goal_trials,
    study_trials,
    switched_off,
    truth_budget,
)
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
    return study_trials(campaign, straight_advice(), trials)


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
    assert (limit.cause, limit.test, limit.axis) == ('localization', 'SL', 1)
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
    assert answer.kind is Kind.UNDECIDED
    assert answer.more_trials > 5  # 21 without a failure decide


def test_trials_that_disagree_with_the_draws_are_spoken_of(campaign):
    answer = study(campaign, Trials(odometry_m=0.2)).answers[Criterion.ODOMETRY]
    assert 'sampled drives predict' in answer.note and answer.note in str(answer)


REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)

AHEAD = Pose2D(10.0, 0.0, 0.0)


def trial(estimate, truth, odometry=(0.0, 0.0, 0.0), number=1, outcome='succeeded'):
    return row('SL', '90', number, outcome, odom=odometry, world=truth, **{'global': estimate})


def goal_trials_of(rows):
    return goal_trials(results_of(rows).trials, AHEAD)


def trials(count, seed=1, encoder_m=0.0):
    """Trials whose stop spreads by 3 mm along, and localization by 2 mm and `encoder_m` across."""
    rng = np.random.default_rng(seed)
    stop, fix, encoder = rng.normal(0.0, 0.003, count), rng.normal(0.001, 0.002, count), rng.normal(0.0, 1.0, count)
    return [
        trial((each, 0.0, 0.0), (each, side + encoder_m * step, 0.0), number=number)
        for number, (each, side, step) in enumerate(zip(stop, fix, encoder), 1)
    ]


def test_each_criterion_has_its_error():
    one = goal_trials_of([trial((0.01, 0.0, 0.0), (0.06, 0.0, 0.0), (0.1, 0.0, 0.0))])
    within = {criterion: one.counts(criterion, REQUIREMENT).within for criterion in Criterion}
    assert within == {Criterion.ODOMETRY: 1, Criterion.POSE_ESTIMATE: 1, Criterion.TRUTH: 0}


def test_a_trial_that_gave_up_is_not_within_but_its_odometry_may_be():
    lost = trial((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), outcome='lost')
    one = goal_trials_of([lost, row('SL', '90', 2, 'lost')])
    within = {criterion: one.counts(criterion, REQUIREMENT).within for criterion in Criterion}
    assert within == {Criterion.ODOMETRY: 1, Criterion.POSE_ESTIMATE: 0, Criterion.TRUTH: 0}
    assert len(one.known_numbers) == 0


def test_the_encoders_part_is_the_difference_to_the_finest_one():
    finest = goal_trials_of(trials(2000))
    budget, count = truth_budget(goal_trials_of(trials(2000, encoder_m=0.01)), finest, finest, {})
    assert count == 2000
    assert budget.parts[STOPPING].std[0] == pytest.approx(0.003, rel=0.1)
    assert budget.parts[LOCALIZATION].bias[1] == pytest.approx(0.001, abs=2e-4)
    assert budget.parts[ENCODER].std[1] == pytest.approx(0.01, rel=0.1)
    total = sum(part.variance for part in budget.parts.values()) + budget.rest.variance
    np.testing.assert_allclose(total, budget.found.variance)


def test_a_cause_that_is_switched_off_has_its_own_part():
    ends, finest = goal_trials_of(trials(2000, encoder_m=0.01)), goal_trials_of(trials(2000))
    budget, _ = truth_budget(ends, ends, finest, {'wheel slip': finest})
    assert budget.parts['wheel slip'].std[1] == pytest.approx(0.01, rel=0.1)
    assert budget.parts[ENCODER].std[1] == 0.0
    np.testing.assert_allclose(budget.rest.variance, 0.0, atol=3e-6)


def test_a_budget_pairs_trials_and_needs_some():
    ends = goal_trials_of(trials(20))
    late = goal_trials_of(trials(40)[13:])
    assert truth_budget(ends, ends, late, {}) == (None, 7)


@pytest.fixture(name='robot')
def robot_fixture():
    config = load_robot_config(ROOT / 'config')
    return lambda **values: override(config, {key.replace('__', '.'): value for key, value in values.items()})


def test_each_cause_that_there_is_is_switched_off_by_itself_and_all_at_once(robot):
    slip, edges = {'simulator__wheel_errors__slip_noise': 1e-6}, {'config__encoder__edge_error': 0.1}
    found = switched_off([robot(**slip, **edges)])
    assert list(found) == [AS_IT_IS, 'without wheel slip', 'without edge errors', WITHOUT_ALL]
    assert found[AS_IT_IS] == {}
    assert found['without wheel slip']['simulator.wheel_errors.slip_noise'] == 0.0
    assert 'config.encoder.edge_error' not in found['without wheel slip']
    assert found[WITHOUT_ALL] == {**found['without wheel slip'], **found['without edge errors']}


def test_what_is_switched_off_leaves_an_ideal_robot(robot):
    given = {
        'simulator__wheel_errors__left_slip': 0.01,
        'simulator__wheel_errors__radius_spread': 0.01,
        'simulator__wheel_errors__wheel_separation_error': 0.02,
        'config__encoder__hysteresis': 1.0,
        'config__encoder__faults__max_count_rate': 1000.0,
    }
    without = switched_off([robot(**given)])[WITHOUT_ALL]
    values = {key.replace('__', '.'): value for key, value in given.items()}
    config = load_robot_config(ROOT / 'config')
    assert override(config, {**values, **without}) == override(config, {})


def test_all_errors_of_an_encoder_belong_to_a_cause():
    """What is left says which encoder it is."""
    known = {*SENSOR_ERRORS, *UNEVEN_LINES, 'faults'}
    kinds = {'sensor', 'lines', 'decoding', 'pole_pairs', 'bits', 'side', 'gear_ratio', 'direction'}
    assert set(EncoderModel.model_fields) == known | kinds
