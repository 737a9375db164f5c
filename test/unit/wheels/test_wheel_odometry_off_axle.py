"""Odometry of a base frame that is not on the axle: it swings around the axle's middle."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams

MS = 1_000_000
SEPARATION_M = 0.4
AXLE_X_M = -0.15


def estimates(axle_x_m, reports):
    """The estimates after whole pulses of both wheels, of 1000 a revolution of 0.2 m."""
    odometry = WheelOdometry(OdometryParams(ppr=1000, axle_x=axle_x_m, max_wheel_speed=1e9))
    return [odometry.update(50 * MS * index, *counts) for index, counts in enumerate(reports)]


def test_a_turn_in_place_moves_the_base_on_a_circle_about_the_axle():
    m_per_pulse = 0.2 * math.pi / 1000
    for pulses in (-400, -37, 250, 1100):
        _, estimate = estimates(AXLE_X_M, [(0, 0), (-pulses, pulses)])
        turn_rad = 2 * pulses * m_per_pulse / SEPARATION_M
        pose = estimate.base_pose_in_odom
        assert pose.x_m == pytest.approx(AXLE_X_M * (1 - math.cos(turn_rad)), abs=1e-12)
        assert pose.y_m == pytest.approx(-AXLE_X_M * math.sin(turn_rad), abs=1e-12)
        assert pose.yaw_rad == pytest.approx(wrap_angle(turn_rad))
        assert estimate.linear_velocity_mps == pytest.approx(0.0)
        assert estimate.angular_velocity_radps == pytest.approx(turn_rad / 0.05)
        assert estimate.lateral_velocity_mps == pytest.approx(-AXLE_X_M * turn_rad / 0.05)


def test_the_base_is_where_a_rigid_body_has_it():
    reports = np.cumsum([(0, 0), *np.random.default_rng(1).integers(-40, 90, (60, 2)).tolist()], axis=0).tolist()
    ahead = Pose2D(AXLE_X_M, 0.0, 0.0)
    for axle, base in zip(estimates(0.0, reports), estimates(AXLE_X_M, reports)):
        expected = ahead.compose(axle.base_pose_in_odom).compose(ahead.inverse())
        assert base.base_pose_in_odom == pytest.approx(expected, abs=1e-12)
        assert base.twist_covariance == pytest.approx(axle.twist_covariance)
        assert axle.lateral_velocity_mps == 0.0


def test_the_covariance_is_that_of_the_axle_carried_to_the_base():
    reports = [(0, 0), (700, 900), (1000, 1400)]
    axle, base = estimates(0.0, reports)[-1], estimates(AXLE_X_M, reports)[-1]
    yaw_rad = axle.base_pose_in_odom.yaw_rad
    jacobian = np.eye(3)
    jacobian[:2, 2] = AXLE_X_M * math.sin(yaw_rad), -AXLE_X_M * math.cos(yaw_rad)
    assert base.pose_covariance == pytest.approx(jacobian @ axle.pose_covariance @ jacobian.T, rel=1e-9)
