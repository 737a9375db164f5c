"""Tests are driven no faster than the robot can."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
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


def test_a_drive_of_more_than_a_day_is_refused():
    limits = {'speed': 0.001, 'acceleration': 0.001}
    long = TestDefinition.from_mapping(
        {'name': 'T', 'world': 'w', 'drive': [{'straight': 1000.0}], 'limits': limits}, ''
    )
    with pytest.raises(ConfigError, match=r'^test T: its drive takes 1000002 s .*; allowed: up to 86400 s$'):
        at_pace_of(DriveParams(), long)
    brisk = long.model_copy(update={'limits': TEST.limits})
    with pytest.raises(ConfigError, match='its drive takes'):
        at_pace_of(DriveParams(max_linear_speed=0.001), brisk)
    assert at_pace_of(DriveParams(), brisk) is brisk
