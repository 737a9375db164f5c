"""The mean twist of two wheels, and its covariance."""

import numpy as np
import pytest

from diff_encoder_sim.odometry.mean_twist import mean_twist

SEPARATION_M, INTERVAL_S = 0.4, 0.05
M_PER_PULSE = (0.007, 0.0005)
READING_VARS_M2 = tuple(metres**2 / 12 for metres in M_PER_PULSE)


def test_the_twist_is_that_of_the_two_travels():
    linear_mps, angular_radps, _ = mean_twist((10, -30), M_PER_PULSE, READING_VARS_M2, INTERVAL_S, SEPARATION_M, 0.0)
    left_mps, right_mps = 10 * 0.007 / INTERVAL_S, -30 * 0.0005 / INTERVAL_S
    assert linear_mps == pytest.approx((left_mps + right_mps) / 2)
    assert angular_radps == pytest.approx((right_mps - left_mps) / SEPARATION_M)


def test_the_covariance_is_that_of_two_roundings_and_of_motion_noise():
    _, _, covariance = mean_twist((10, -30), M_PER_PULSE, READING_VARS_M2, INTERVAL_S, SEPARATION_M, 1e-4)
    rng = np.random.default_rng(1)
    roundings = rng.uniform(-0.5, 0.5, (2, 200_000, 2)) * M_PER_PULSE
    noise = rng.normal(0.0, np.sqrt(1e-4 * np.abs([10 * 0.007, 30 * 0.0005])), (200_000, 2))
    left_m, right_m = (roundings[0] - roundings[1] + noise).T
    drawn = np.cov((left_m + right_m) / 2 / INTERVAL_S, (right_m - left_m) / SEPARATION_M / INTERVAL_S)
    assert covariance == pytest.approx(drawn, rel=0.02)


def test_over_no_time_there_is_no_twist():
    linear_mps, angular_radps, covariance = mean_twist((3, 4), M_PER_PULSE, READING_VARS_M2, 0.0, SEPARATION_M, 1e-4)
    assert (linear_mps, angular_radps) == (0.0, 0.0) and not covariance.any()
