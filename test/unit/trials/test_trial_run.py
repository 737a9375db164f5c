"""A trial in lockstep from its plan to its result."""

import math

import pytest

from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.trial_run import run_trial
from lockstep_trials import ALTO, HALL, params_of, plan_of


def test_a_scripted_trial_has_errors_by_each_pose_source_that_it_has():
    plan = plan_of(HALL, 1024, nav='scripted', start={'x': -3.0, 'yaw': math.pi / 2}, drive=[{'straight': 0.5}])
    result = run_trial(plan, ALTO, params_of(), 'none')
    assert result.outcome is Outcome.SUCCEEDED
    assert result.distance_m == pytest.approx(0.5, abs=1e-3)
    # A trapezoid of 0.5 m, half a second's pause, a second at rest.
    assert result.duration_s == pytest.approx(0.5 / 0.45 + 0.45 / 0.7 + 0.5 + 1.0, abs=0.1)
    assert result.errors[PoseSource.AMCL] is None
    for source in (PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD):
        assert result.errors[source] == pytest.approx((0.0, 0.0, 0.0), abs=2e-3), source


def test_its_bag_is_whole_or_not_there(tmp_path):
    bag = tmp_path / 'trial.bag'
    plan = plan_of(HALL, 1024, nav='scripted', drive=[{'straight': 0.1}], bag=bag)
    run_trial(plan, ALTO, params_of(), 'minimal')
    assert bag.is_file()
    refused = plan_of(HALL, nav='upstream', bag=tmp_path / 'refused.bag')
    with pytest.raises(Exception, match='nav upstream'):
        run_trial(refused, ALTO, params_of(), 'minimal')
    assert [path.name for path in tmp_path.iterdir()] == ['trial.bag']
