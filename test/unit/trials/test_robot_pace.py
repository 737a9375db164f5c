"""Tests are driven no faster than the robot can."""

from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.simulation.simulator import DriveParams
from diff_encoder_sim.trials.campaign_loading import at_pace_of
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive

TEST = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 2.0}]}, '')


def test_a_robot_that_is_faster_drives_the_test_as_it_is():
    assert at_pace_of(DriveParams(), TEST) is TEST


def test_each_limit_that_the_motors_do_not_reach_is_lowered():
    limits = at_pace_of(DriveParams(max_linear_speed=0.22, max_angular_acceleration=1.0), TEST).limits
    assert (limits.speed, limits.angular_acceleration) == (0.22, 1.0)
    assert (limits.acceleration, limits.angular_speed) == (TEST.limits.acceleration, TEST.limits.angular_speed)


def test_a_slower_drive_has_the_same_length_and_takes_longer():
    slow = at_pace_of(DriveParams(max_linear_speed=0.1), TEST)
    assert slow.drive_end() == TEST.drive_end()
    assert ScriptedDrive(slow).duration_s > 20.0 > ScriptedDrive(TEST).duration_s
