"""Where a trial is to end, and what its plan has to name."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import LivePlan, Trial, TrialPlan
from diff_encoder_sim.wheels.encoder_params import PerWheel

TEST = TestDefinition.from_mapping(
    {'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}], 'route': [{'goal': {'x': 1.0, 'yaw': 0.5}}]}, ''
)
FILES = {'trial': Trial(test=TEST), 'world': 'w.world', 'map': 'w.yaml', 'bag': ''}


def test_a_scripted_trial_ends_with_its_drive_and_any_other_at_the_goal_of_its_route():
    assert Trial(test=TEST, nav='scripted').goal() == (2.0, 0.0, 0.0)
    assert Trial(test=TEST, nav='embedded').goal() == (1.0, 0.0, 0.5)


def test_what_is_usual_is_left_out_of_a_bag():
    usual = Trial(test=TEST).model_dump()
    assert {'encoder', 'resolution', 'variant', 'axle_x', 'counter_modulus'}.isdisjoint(usual)
    real = Trial(test=TEST, ppr=PerWheel(left=8192, right=8192), encoder='amt102', resolution='2048 lines x 4')
    assert real.encoder_label == '8192 amt102' and Trial(test=TEST).encoder_label == '90'
    assert Trial.from_mapping(real.model_dump(), '') == real


def test_a_plan_for_the_live_graph_names_its_rates():
    assert TrialPlan.from_mapping(FILES, '').slam == 'none'
    with pytest.raises(ConfigError, match='/trial: report_rate: missing'):
        LivePlan.from_mapping({**FILES, 'command_period': 0.05}, '/trial')
    with pytest.raises(ConfigError, match='report_rate: given 0'):
        LivePlan.from_mapping({**FILES, 'report_rate': 0.0, 'command_period': 0.05}, '')
