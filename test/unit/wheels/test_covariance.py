"""Covariances of odometry against closed forms, simulated wheels, and the same in matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.wheels.covariance import (
    NO_ERRORS,
    LateralAcceleration,
    PlanarCovariance,
    Remainder,
    carry_geometry_errors,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
)
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from phase_drives import DRIVES, sampled_nees

SEPARATION_M = 0.4


def assert_equal_covariances(covariance, expected):
    """To rounding, by the standard deviations: what cancels out has no relative precision."""
    sigmas = np.sqrt(np.diag(expected))
    assert (np.abs(covariance - expected) <= 1e-12 * np.outer(sigmas, sigmas) + 1e-30).all()
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
    expected = jacobian @ np.diag(pulses_m2 / 12) @ jacobian.T
    variances_m2 = reading_variance(left_m), reading_variance(right_m)
    covariance = quantisation_covariance(Pose2D(x_m, y_m, yaw_rad), variances_m2, SEPARATION_M)
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


def test_the_remainder_of_a_standing_wheel_turns_the_robot_about_it():
    """As a rigid body about the wheel: what it shifted before the turn, it shifts along the heading after it."""
    wheel, steps = Remainder(), 200
    wheel.step(3, 0.0, 0.0)
    wheel.step(2, 0.0, 0.0)
    for yaw_rad in (np.arange(steps) + 0.5) * 1.2 / steps:
        wheel.step(0, math.sin(yaw_rad) * 1.2 / steps, -math.cos(yaw_rad) * 1.2 / steps)
    (xx, _, yy), (x, y) = wheel.moments()
    half_cos, half_sin = 0.5 * math.cos(1.2), 0.5 * math.sin(1.2)
    assert xx + 2.0 * half_cos * x + half_cos**2 / 12.0 == pytest.approx((1.0 - half_cos) ** 2 / 12.0, rel=1e-3)
    assert yy + 2.0 * half_sin * y + half_sin**2 / 12.0 == pytest.approx(half_sin**2 / 12.0, rel=1e-3)


@pytest.mark.parametrize('speed', [0.031, -0.237, 3.965, 8.953])
def test_remainders_of_a_steady_wheel_compensate_each_other(speed):
    """The covariance of two of them, n reports apart, is (1/6 - f (1 - f)) / 2 with f the fraction of n speeds."""
    known, reports, ways_m2 = 300, 100, []
    for phase in np.random.default_rng(4).uniform(0.0, 1.0, 20):
        wheel = Remainder()
        counts = np.diff(np.floor(phase + speed * np.arange(known + reports + 1))).astype(int).tolist()
        for report, count in enumerate(counts):
            wheel.step(count, 0.0, 0.1 if report >= known else 0.0)
        ways_m2.append(wheel.moments()[0][2])
    lags = np.subtract.outer(np.arange(reports + 1), np.arange(reports + 1)) * speed % 1.0
    shifts = np.array([0.05, *[0.1] * (reports - 1), 0.05])  # half of a report's by the remainder before it
    expected = 0.5 * shifts @ (1.0 / 6.0 - lags * (1.0 - lags)) @ shifts
    assert np.mean(ways_m2) == pytest.approx(expected, rel=0.3)


def test_remainders_of_a_wheel_that_changes_its_speed_are_independent():
    wheel, rng, reports = Remainder(), np.random.default_rng(2), 2000
    for count in rng.integers(0, 30, reports).tolist():
        wheel.step(count, 0.0, 0.1)
    assert wheel.moments()[0][2] == pytest.approx(reports * 0.1**2 / 12.0, rel=0.1)


def test_the_covariance_is_positive_semidefinite_after_any_reports():
    rng = np.random.default_rng(8)
    for _ in range(20):
        odometry = WheelOdometry(OdometryParams(ppr={'left': 20, 'right': 90}, motion_noise=0.0))
        counts = np.cumsum(rng.integers(-1, 3, (100, 2)) * rng.integers(0, 2, (100, 2)), axis=0)
        for report, (left, right) in enumerate(counts.tolist()):
            covariance = odometry.update(50_000_000 * report, left, right).of_pose.matrix()
            assert np.linalg.eigvalsh(covariance).min() > 0.0


@pytest.mark.parametrize(
    ('drive', 'ppr', 'steady_mps', 'most'),
    [
        ('squares, pivots', 40, None, 1.25),
        ('out and back, pivot', 20, None, 1.25),
        ('circle', 90, None, 1.25),
        ('zigzag', 1024, None, 1.25),
        ('turns in place', 90, 0.14, 2.0),  # 1.003 pulses in each report
    ],
)
def test_the_covariance_is_consistent_over_wheel_phases(drive, ppr, steady_mps, most):
    """Over 1,000 phases and all drives: test/benchmark/odometry_nees.py."""
    nees = [sampled_nees(DRIVES[drive], ppr, seed, steady_mps) for seed in range(120)]
    assert 0.8 < np.mean(nees) < most


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
