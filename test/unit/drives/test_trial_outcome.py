"""Outcomes as tables show them, and how far from the goal is too far."""

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import GOAL_DISTANCE_M, goal_error

GOAL = Pose2D(1.0, 2.0, 0.0)


@pytest.mark.parametrize('yaw_rad', [0.0, 3.0])
def test_a_robot_within_the_distance_is_at_its_goal_whatever_its_heading(yaw_rad):
    assert goal_error(Pose2D(1.0 + GOAL_DISTANCE_M, 2.0, yaw_rad), GOAL) is None


def test_a_robot_farther_off_is_not_and_the_reason_has_both_distances():
    reason = goal_error(Pose2D(1.3, 2.4, 0.0), GOAL, limit_m=0.49)
    assert '0.50 m from the goal' in reason and '0.49 m' in reason
