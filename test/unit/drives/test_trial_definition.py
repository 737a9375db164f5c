"""A trial: its goal and outcome, its wheels, and its text in a bag."""

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import GOAL_DISTANCE_M, Trial, goal_error, wheels_of
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

TEST = TestDefinition.from_mapping(
    {'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}], 'route': [{'goal': {'x': 1.0, 'yaw': 0.5}}]}, ''
)


def test_a_scripted_trial_ends_with_its_drive_and_any_other_at_the_goal_of_its_route():
    assert Trial(test=TEST, nav='scripted').goal() == (2.0, 0.0, 0.0)
    assert Trial(test=TEST, nav='embedded').goal() == (1.0, 0.0, 0.5)


def test_usual_values_are_left_out_of_a_bag():
    usual = Trial(test=TEST).model_dump()
    assert {'encoder', 'resolution', 'variant', 'axle_x', 'counter_modulus'}.isdisjoint(usual)
    real = Trial(test=TEST, ppr=PerWheel(left=8192, right=8192), encoder='amt102', resolution='2048 lines x 4')
    assert real.encoder_label == '8192 amt102' and Trial(test=TEST).encoder_label == '90'
    assert Trial.from_mapping(real.model_dump(), '') == real


@pytest.mark.parametrize('yaw_rad', [0.0, 3.0])
def test_a_robot_within_the_distance_is_at_its_goal_whatever_its_heading(yaw_rad):
    assert goal_error(Pose2D(1.0 + GOAL_DISTANCE_M, 2.0, yaw_rad), Pose2D(1.0, 2.0, 0.0)) is None
    assert '0.51 m from the goal' in goal_error(Pose2D(1.51, 2.0, yaw_rad), Pose2D(1.0, 2.0, 0.0))


def test_the_parameters_of_odometry_are_kept():
    of_odometry = OdometryParams(wheel_diameter=0.07, axle_x=0.1)
    of_encoder = EncoderParams(left_joint='l', left_reversed=True, counter_modulus=4096)
    trial = Trial(test=TEST, **wheels_of(of_odometry, of_encoder))
    again = Trial.model_validate_json(trial.model_dump_json())
    assert again == trial
    assert (again.wheel_diameter, again.wheel_separation, again.axle_x) == (0.07, 0.4, 0.1)
    joints = again.left_joint, again.right_joint, again.left_reversed, again.right_reversed
    assert (*joints, again.counter_modulus) == ('l', 'right_wheel_joint', True, False, 4096)
