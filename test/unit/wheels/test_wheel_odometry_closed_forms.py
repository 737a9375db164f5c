"""Odometry behind simulated encoders against closed forms (docs/adr/0002-odometry-covariance.md)."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import DiffEncoder, EncoderParams

MS = 1_000_000
DIAMETER_M, SEPARATION_M = 0.2, 0.4
PPRS = [40, 90, 1024, 4096]
JOINTS = ['left_wheel_joint', 'right_wheel_joint']
SEEDS = 200
# 99 % of sample variances over 200 seeds lie in this range around the true one (chi-square
# quantiles for 199 degrees of freedom, divided by 199; errors here are bounded, so less spread).
VARIANCE_RANGE_99 = (0.760, 1.279)


def metres_per_pulse(ppr):
    return math.pi * DIAMETER_M / ppr


def odometry(**params):
    return WheelOdometry(OdometryParams.from_mapping({'max_wheel_speed': 1e9, **params}, 'test'))


def drive_wheels(ppr, wheel_angles_rad, seed):
    """Odometry's last estimate after (n, 2) wheel angles 50 ms apart, from random phases."""
    phases = np.random.default_rng(seed).uniform(0, 2 * math.pi, 2)
    encoder = DiffEncoder(EncoderParams.from_mapping({'ppr': ppr}, ''))
    wheel_odometry = odometry(ppr=ppr, motion_noise=0.0)
    for index, angles in enumerate((wheel_angles_rad + phases).tolist()):
        estimate = wheel_odometry.update(*encoder.update(index * 50 * MS, JOINTS, angles))
    return estimate


def errors_over_seeds(ppr, wheel_angles_of_seed, truth_of_seed):
    """(seeds, 3) odometry minus truth, and the estimates."""
    rows, estimates = [], []
    for seed in range(SEEDS):
        estimate = drive_wheels(ppr, wheel_angles_of_seed(seed), seed)
        truth = truth_of_seed(seed)
        pose = estimate.base_pose_in_odom
        rows.append([pose.x_m - truth.x_m, pose.y_m - truth.y_m, wrap_angle(pose.yaw_rad - truth.yaw_rad)])
        estimates.append(estimate)
    return np.array(rows), estimates


@pytest.mark.heavy
@pytest.mark.parametrize('ppr', PPRS)
def test_straight_drive_spread_is_the_closed_form(ppr):
    """Lateral (S d/L) sqrt(1/6), heading (d/L) sqrt(1/3), over wheel phases and end points."""
    length_m = 20.0
    end_m = length_m + np.random.default_rng(1).uniform(0, 0.1, SEEDS)  # ends anywhere in a pulse

    def wheel_angles(seed):
        # 1.9 m/s: quick, and in no simple ratio to any of the pulse lengths.
        travel_m = np.append(np.arange(0, end_m[seed], 0.095 * math.sqrt(1.01)), end_m[seed])
        return np.column_stack([travel_m, travel_m]) / (DIAMETER_M / 2)

    errors, estimates = errors_over_seeds(ppr, wheel_angles, lambda seed: Pose2D(end_m[seed], 0.0, 0.0))
    d = metres_per_pulse(ppr)
    expected = np.array([length_m * d / SEPARATION_M * math.sqrt(1 / 6), d / SEPARATION_M * math.sqrt(1 / 3)])
    ratios = np.mean(errors[:, 1:] ** 2, axis=0) / expected**2
    assert (ratios > VARIANCE_RANGE_99[0]).all() and (ratios < VARIANCE_RANGE_99[1]).all(), ratios
    assert np.abs(errors[:, 2]).max() <= d / SEPARATION_M * 1.000001  # bounded: a pulse a wheel
    # Its own covariance says the same: NEES of 3 numbers averages 3.
    nees = [error @ np.linalg.solve(estimate.pose_covariance, error) for error, estimate in zip(errors, estimates)]
    assert 0.7 < np.mean(nees) / 3 < 1.3


@pytest.mark.heavy
@pytest.mark.parametrize('ppr', PPRS)
def test_turn_in_place_spread_is_the_closed_form(ppr):
    """Heading (d/L) sqrt(1/3) over angles that are no whole number of pulses."""
    end_rad = np.random.default_rng(2).uniform(8 * math.pi, 10 * math.pi, SEEDS)

    def wheel_angles(seed):
        turned_rad = np.append(np.arange(0, end_rad[seed], 0.5), end_rad[seed])
        rolled_rad = turned_rad * SEPARATION_M / DIAMETER_M
        return np.column_stack([-rolled_rad, rolled_rad])

    errors, _ = errors_over_seeds(ppr, wheel_angles, lambda seed: Pose2D(0.0, 0.0, end_rad[seed]))
    expected_rad = metres_per_pulse(ppr) / SEPARATION_M * math.sqrt(1 / 3)
    ratio = np.mean(errors[:, 2] ** 2) / expected_rad**2
    assert VARIANCE_RANGE_99[0] < ratio < VARIANCE_RANGE_99[1]
