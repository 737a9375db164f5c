"""The end of a drive, step by step."""

import math

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.goal_stopping import LatchedStopRotate, Motion
from navigation_scenes import dwa_params

GOAL = Pose2D(0.0, 0.0, 1.0)


def controller(**changes):
    return LatchedStopRotate(dwa_params(**changes), 0.05)


def always(*_):
    return True


def test_position_is_reached_within_tolerance_and_then_latched():
    latched, free = controller(), controller(latch_xy_goal_tolerance=False)
    for at, expected in ((0.06, (False, False)), (0.05, (True, True)), (0.07, (True, False))):
        motion = Motion(Pose2D(at, 0.0, 0.0), 0.0, 0.0)
        assert (latched.is_position_reached(motion, GOAL), free.is_position_reached(motion, GOAL)) == expected
    latched.reset()
    assert not latched.is_position_reached(Motion(Pose2D(0.07, 0.0, 0.0), 0.0, 0.0), GOAL)


def test_goal_is_reached_only_when_it_stands_and_looks_there():
    for yaw, linear, angular, expected in (
        (1.05, 0.0, 0.0, True),
        (1.06, 0.0, 0.0, False),
        (1.0, 0.11, 0.0, False),
        (1.0, 0.0, 0.11, False),
        (1.0 - 2 * math.pi, 0.0, 0.0, True),
    ):
        motion = Motion(Pose2D(0.03, 0.0, yaw), linear, angular)
        assert controller().is_goal_reached(motion, GOAL) is expected


def test_it_brakes_then_turns_then_stops():
    stop = controller()
    assert stop.command(Motion(IDENTITY, 0.3, -0.5), GOAL, always) == pytest.approx((0.265, -0.255))
    assert stop.command(Motion(IDENTITY, 0.05, 0.0), GOAL, always) == pytest.approx((0.0, 0.245))
    # Turning, it may be fast without that counting as not stopped.
    assert stop.command(Motion(IDENTITY, 0.0, 0.7), GOAL, always) == pytest.approx((0.0, 0.945))
    assert stop.command(Motion(Pose2D(0, 0, 0.97), 0.0, 0.3), GOAL, always) == (0.0, 0.0)


@pytest.mark.parametrize(
    ('yaw', 'angular', 'expected'),
    [
        (0.9, 0.0, 0.2),  # min_vel_theta, the rest of 0.1 rad would ask for less
        (-2.0, 0.9, 1.0),  # max_vel_theta
        (1.4, -0.5, -0.4),  # to the right, as fast as the rest in one second
        (0.7, 0.9, 0.655),
    ],
)  # no more braking than the acceleration limit
def test_turning_speed_keeps_all_limits(yaw, angular, expected):
    stop = controller()
    stop.command(Motion(Pose2D(0, 0, yaw), 0.0, 0.0), GOAL, always)  # it stands, so it turns
    assert stop.command(Motion(Pose2D(0, 0, yaw), 0.0, angular), GOAL, always)[1] == pytest.approx(expected)


def test_a_turn_that_would_collide_is_not_made():
    assert controller().command(Motion(IDENTITY, 0.0, 0.0), GOAL, lambda *_: False) is None


def test_a_unicycle_ends_at_the_heading():
    stop, yaw, speed = controller(), -2.0, 0.0
    for _ in range(200):
        motion = Motion(Pose2D(0.02, 0.0, yaw), 0.0, speed)
        if stop.is_goal_reached(motion, GOAL):
            break
        speed = stop.command(motion, GOAL, always)[1]
        yaw += speed * 0.05
    assert abs(wrap_angle(yaw - 1.0)) <= 0.052


def test_a_margin_lets_the_robot_come_closer_before_it_turns():
    """Localization moves by millimetres while it turns: who stopped on the edge would be outside."""
    motion = Motion(Pose2D(0.0, 0.0, 0.0), 0.0, 0.0)
    for margin, distance_m, is_reached in ((0.0, 0.049, True), (0.2, 0.041, False), (0.2, 0.039, True)):
        controller = LatchedStopRotate(
            DwaParams.from_mapping(
                {'xy_goal_tolerance': 0.05, 'latch_margin': margin, 'latch_xy_goal_tolerance': True}, ''
            ),
            0.05,
        )
        assert controller.is_position_reached(motion, Pose2D(distance_m, 0.0, 0.0)) is is_reached
    assert controller.is_position_reached(motion, Pose2D(0.06, 0.0, 0.0))  # latched
