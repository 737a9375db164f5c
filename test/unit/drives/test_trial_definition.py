"""A trial: its goal and outcome, its plan, its wheels, and what its bag holds of it."""

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import (
    GOAL_DISTANCE_M,
    OF_ENCODER,
    OF_ODOMETRY,
    Trial,
    goal_error,
    wheels_of,
)
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from reencoding_drives import ROS2, drive, write
from trial_bags import trial, write_bag

TEST = TestDefinition.from_mapping(
    {'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}], 'route': [{'goal': {'x': 1.0, 'yaw': 0.5}}]}, ''
)


def test_a_scripted_trial_ends_with_its_drive_and_any_other_at_the_goal_of_its_route():
    assert Trial(test=TEST, nav='scripted').goal() == (2.0, 0.0, 0.0)
    assert Trial(test=TEST, nav='embedded').goal() == (1.0, 0.0, 0.5)


def test_what_is_usual_is_left_out_of_a_bag():
    usual = Trial(test=TEST).model_dump()
    assert {'encoder', 'resolution', 'variant', 'axle_x', 'counter_modulus'}.isdisjoint(usual)
    real = Trial(test=TEST, ppr=PerWheel(left=8192, right=8192), encoder='amt102', resolution='2048 lines x 4')
    assert real.encoder_label == '8192 amt102' and Trial(test=TEST).encoder_label == '90'
    assert Trial.from_mapping(real.model_dump(), '') == real


GOAL = Pose2D(1.0, 2.0, 0.0)


@pytest.mark.parametrize('yaw_rad', [0.0, 3.0])
def test_a_robot_within_the_distance_is_at_its_goal_whatever_its_heading(yaw_rad):
    assert goal_error(Pose2D(1.0 + GOAL_DISTANCE_M, 2.0, yaw_rad), GOAL) is None


WHEELED = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 1.0}]}, '')


def test_all_that_odometry_needs_is_kept():
    odometry, encoder = (
        OdometryParams(wheel_diameter=0.07, axle_x=0.1),
        EncoderParams(left_joint='l', left_reversed=True, counter_modulus=4096),
    )
    trial = Trial(test=WHEELED, **wheels_of(odometry, encoder))
    again = Trial.model_validate_json(trial.model_dump_json())
    assert again == trial
    assert {name: getattr(again, name) for name in OF_ODOMETRY} == {
        'wheel_diameter': 0.07,
        'wheel_separation': 0.4,
        'axle_x': 0.1,
    }
    assert [getattr(again, name) for name in OF_ENCODER] == ['l', 'right_wheel_joint', True, False]
    assert again.counter_modulus == 4096


def trial_of(path):
    with open_source(path) as source:
        return trial_of_source(path, source)


def test_a_bag_of_no_trial_says_nothing_of_one(tmp_path):
    assert trial_of(write_bag(tmp_path / 'a.bag', None)) is None
    assert trial_of(write_bag(tmp_path / 'b.bag', trial())) == trial()


def test_a_bag_of_ros_2_has_a_trial(tmp_path):
    assert trial_of(write(tmp_path / 'none', drive(ROS2))) is None
    path = write(tmp_path / 'bag', [('/trial', 1, ROS2.text(trial().model_dump_json()))])
    assert trial_of(path) == trial()
