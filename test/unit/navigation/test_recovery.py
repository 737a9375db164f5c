"""Recovery behaviours: their order, and the turn step by step; clearing is in test_costmap and test_navigator."""

import math

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.goal_stopping import Rotation
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams, recoveries_of
from navigation_simulation import dwa_params, local_costmap


def test_rotation_goes_once_around():
    yaw, speeds, text = 0.3, [], ''
    rotation = Rotation(dwa_params(), 0, Pose2D(0.0, 0.0, yaw))
    while text != 'turned once around':
        speed, text = rotation.step(50_000_000 * len(speeds), Pose2D(0.0, 0.0, wrap_angle(yaw)), local_costmap())
        speeds.append(speed or 0.0)
        yaw += speeds[-1] * 0.05
        assert len(speeds) < 400
    assert yaw - 0.3 == pytest.approx(2.0 * math.pi, abs=0.1)
    assert set(speeds[:-1]) == {1.0}  # max_vel_theta: 4.9 rad/s^2 stops it within 0.1 rad


@pytest.mark.parametrize(
    ('obstacle_m', 'after_s', 'turns'), [(0.35, 0.0, False), (0.5, 0.0, True), (0.5, 30.0, True), (0.5, 32.0, False)]
)
def test_rotation_ends_if_it_would_collide_or_the_robot_does_not_turn(obstacle_m, after_s, turns):
    rotation = Rotation(dwa_params(), 0, IDENTITY)
    speed, _ = rotation.step(int(after_s * 1e9), IDENTITY, local_costmap([(obstacle_m, 0.0)]))
    assert (speed is not None) is turns


CLOSE_BY_M = pytest.approx(4.0 * math.hypot(0.26, 0.31))  # of ALTO's corners, with footprint_padding
FAR, NEAR = ('conservative_reset', CLEAR_COSTMAP, 2.0), ('aggressive_reset', CLEAR_COSTMAP, CLOSE_BY_M)
TURN = ('rotate_recovery', ROTATE, 3.0)
LISTED = [
    {'name': 'look_around', 'type': ROTATE},
    {'name': 'aggressive_reset', 'type': CLEAR_COSTMAP},
    {'name': 'mine', 'type': CLEAR_COSTMAP},
]


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ({}, [FAR, TURN, NEAR, TURN]),
        ({'clearing_rotation_allowed': False}, [FAR, NEAR]),
        ({'recovery_behavior_enabled': False}, []),
        (
            {'recovery_behaviors': LISTED, 'clearing_rotation_allowed': False},
            [('look_around', ROTATE, 3.0), NEAR, ('mine', CLEAR_COSTMAP, 3.0)],
        ),
    ],
)
def test_order_of_recoveries_is_move_bases_or_that_of_the_list(given, expected):
    local = {'rolling_window': True, 'global_frame': 'odom'}
    params = {'conservative_reset_dist': 2.0, 'local_costmap': local, **given}
    assert recoveries_of(NavigatorParams.from_mapping(params, ''), math.hypot(0.26, 0.31)) == expected
