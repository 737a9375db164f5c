"""Covariances of odometry against closed forms, simulated wheels, and the same in matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc, poses_of_wheels, wrap_angle
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.covariance import (
    NO_ERRORS,
    LateralAcceleration,
    PlanarCovariance,
    carry_geometry_errors,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
    residual_std,
)
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

SEPARATION_M = 0.4


def assert_equal_covariances(covariance, expected):
    """To rounding, by the standard deviations: what cancels out has no relative precision."""
    sigmas = np.sqrt(np.diag(expected))
    assert (np.abs(covariance - expected) <= 1e-12 * np.outer(sigmas, sigmas)).all()
    assert (covariance == covariance.T).all()


@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(-9, 9), st.floats(1e-5, 0.1), st.floats(1e-5, 0.1))
def test_quantisation_covariance_is_that_of_four_roundings(x_m, y_m, yaw_rad, left_m, right_m):
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    at_start = [
        [0.5 + y_m / SEPARATION_M, 0.5 - y_m / SEPARATION_M],
        [-x_m / SEPARATION_M, x_m / SEPARATION_M],
        [-1 / SEPARATION_M, 1 / SEPARATION_M],
    ]
    now = [[0.5 * cos_yaw] * 2, [0.5 * sin_yaw] * 2, [-1 / SEPARATION_M, 1 / SEPARATION_M]]
    jacobian, pulses_m2 = np.hstack([at_start, now]), np.square([left_m, right_m] * 2)
    residual_m2 = residual_std(left_m, right_m) ** 2
    expected = jacobian @ np.diag(pulses_m2 / 12) @ jacobian.T + np.diag([residual_m2, residual_m2, 0])
    readings_m2, pose = (reading_variance(left_m), reading_variance(right_m)), Pose2D(x_m, y_m, yaw_rad)
    covariance = quantisation_covariance(pose, *readings_m2, residual_std(left_m, right_m), SEPARATION_M)
    assert_equal_covariances(covariance.matrix(), expected)


def test_motion_noise_is_carried_on_by_the_jacobians():
    rng = np.random.default_rng(5)
    for _ in range(50):
        root = rng.normal(0, 0.1, (3, 3))
        (yaw_rad, left_m, right_m), covariance = rng.uniform(-1, 1, 3), root @ root.T
        given = PlanarCovariance(*covariance[np.triu_indices(3)].tolist())
        travel_m = (left_m + right_m) / 2
        mid_rad = yaw_rad + (right_m - left_m) / SEPARATION_M / 2
        along, across = np.array([[math.cos(mid_rad), -math.sin(mid_rad)], [math.sin(mid_rad), math.cos(mid_rad)]]).T
        by_pose, by_wheels = np.eye(3), np.empty((3, 2))
        by_pose[:2, 2] = travel_m * across
        for wheel, side in enumerate((-1, 1)):
            by_wheels[:2, wheel] = along / 2 + side * travel_m / SEPARATION_M / 2 * across
            by_wheels[2, wheel] = side / SEPARATION_M
        expected = (
            by_pose @ covariance @ by_pose.T + by_wheels @ np.diag(1e-3 * np.abs([left_m, right_m])) @ by_wheels.T
        )
        assert_equal_covariances(
            propagate_motion_noise(given, yaw_rad, left_m, right_m, SEPARATION_M, 1e-3).matrix(), expected
        )


@pytest.mark.parametrize(
    ('left_m', 'right_m', 'sideways_m2'),
    [(0.02, 0.02, 4e-4), (0.01, 0.03, 3e-4), (-0.02, 0.02, 0.0), (0.0, 0.03, 0.0), (-0.02, -0.02, 4e-4)],
)
def test_a_step_is_moved_sideways_by_the_rounding_of_its_heading(left_m, right_m, sideways_m2):
    """It is gone with the next step: the heading of the pose is not made worse."""
    covariance = propagate_motion_noise(PlanarCovariance(), 0.0, left_m, right_m, SEPARATION_M, 0.0, 1e-2)
    half_turn_rad = 0.5 * (right_m - left_m) / SEPARATION_M
    assert covariance.yy == pytest.approx(1e-2 * sideways_m2 * math.cos(half_turn_rad) ** 2)
    assert covariance.xx == pytest.approx(1e-2 * sideways_m2 * math.sin(half_turn_rad) ** 2)
    assert (covariance.yaw_yaw, covariance.x_yaw, covariance.y_yaw) == (0.0, 0.0, 0.0)


@pytest.mark.heavy
@pytest.mark.parametrize('ppr', [40, 90, 1024])
def test_the_covariance_of_a_winding_drive_is_consistent_over_wheel_phases(ppr):
    """Rounding under way counts where the drive comes back to its start, and the other terms cancel out."""
    ends = [winding_drive(ppr, seed) for seed in range(120)]
    nees = [error @ np.linalg.solve(covariance, error) / 3.0 for error, covariance in ends]
    assert 0.7 < np.mean(nees) < 1.7  # without it 8 to 48


def winding_drive(ppr, seed):
    """Return error and covariance at the end of three rounds of a wavy circle of 1 m, 19 m, without slip."""
    turns_rad = np.full(840, 6 * math.pi / 840) + 0.01 * np.sin(np.arange(840) / 9.0)
    steps_m = 0.0224 + 0.5 * SEPARATION_M * np.outer(turns_rad, [-1.0, 1.0])
    ways_m = np.concatenate([np.zeros((1, 2)), np.cumsum(steps_m, axis=0)])
    truth = poses_of_wheels(ways_m[np.newaxis], 1.0, 1.0, SEPARATION_M, 0.0, True)[0, 0]
    chain = Chain(EncoderParams(ppr=ppr), OdometryParams(ppr=ppr, motion_noise=0.0))
    phases_rad = np.random.default_rng(seed).uniform(0.0, 2 * math.pi, (1, 2))
    estimate = chain.run(Drive(50_000_000 * np.arange(841), ways_m / 0.1), phases_rad).estimates()[-1]
    error = np.array(estimate.base_pose_in_odom) - truth
    error[2] = wrap_angle(error[2])
    return error, estimate.of_pose.matrix()


SMALL = 1e-6


def driven(steps_m, left=1.0, right=1.0, separation=1.0):
    """The pose after steps of both wheels, whose travels and separation are other than they seem."""
    pose = IDENTITY
    for left_m, right_m in steps_m:
        left_true_m, right_true_m = left * left_m, right * right_m
        turn_rad = (right_true_m - left_true_m) / (SEPARATION_M * separation)
        moved = move_along_arc(pose, 0.5 * (left_true_m + right_true_m), turn_rad)
        pose = moved._replace(yaw_rad=pose.yaw_rad + turn_rad)
    return np.array(pose)


def test_errors_are_those_of_drives_with_another_geometry():
    steps_m = np.random.default_rng(3).uniform(-0.002, 0.01, (400, 2))
    errors, yaw_rad = NO_ERRORS, 0.0
    for left_m, right_m in steps_m:
        errors = carry_geometry_errors(errors, yaw_rad, left_m, right_m, SEPARATION_M)
        yaw_rad += (right_m - left_m) / SEPARATION_M
    distance, turn, difference = np.array(errors)
    exact = driven(steps_m)
    half = 0.5 * SMALL
    by_difference = (driven(steps_m, 1.0 - half, 1.0 + half) - exact) / SMALL
    by_both = (driven(steps_m, 1.0 + SMALL, 1.0 + SMALL) - exact) / SMALL
    by_separation = (driven(steps_m, separation=1.0 + SMALL) - exact) / SMALL
    assert difference == pytest.approx(by_difference, rel=1e-3, abs=1e-4)
    assert distance + turn == pytest.approx(by_both, rel=1e-3, abs=1e-4)
    assert -turn == pytest.approx(by_separation, rel=1e-3, abs=1e-4)


def after(seconds, left_mps, right_mps, interval_s=0.02):
    pull = LateralAcceleration(SEPARATION_M)
    for _ in range(round(seconds / interval_s)):
        last = pull.take(interval_s, left_mps * interval_s, right_mps * interval_s)
    return last


@pytest.mark.parametrize('interval_s', [0.001, 0.02, 0.1])
def test_in_a_curve_it_is_speed_times_turn_at_any_rate_of_reports(interval_s):
    # 0.4 m/s and 0.5 rad/s.
    assert after(4.0, 0.3, 0.5, interval_s) == pytest.approx(0.2, rel=1e-3)
    assert after(4.0, 0.5, 0.3, interval_s) == pytest.approx(-0.2, rel=1e-3)
    assert after(4.0, -0.3, -0.5, interval_s) == pytest.approx(0.2, rel=1e-3)  # backwards
