"""The twist of two wheels, and its covariance: of ways, and of speeds by counts and by times of edges."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.odometry import Reading, RimMotion, TwistEstimator, twist_of_rims
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from encoder_drives import RADIUS_M, TICK_NS, drive

SEPARATION_M, INTERVAL_S = 0.4, 0.05
RIMS = RimMotion(0.07, 4e-6), RimMotion(-0.015, 2e-8)


def test_the_covariance_is_that_of_the_two_ways():
    rng = np.random.default_rng(1)
    left_m, right_m = rng.normal(0.0, [[math.sqrt(rim.variance)] for rim in RIMS], (2, 200_000))
    drawn = np.cov((left_m + right_m) / 2 / INTERVAL_S, (right_m - left_m) / SEPARATION_M / INTERVAL_S)
    assert twist_of_rims(RIMS, INTERVAL_S, SEPARATION_M).covariance.matrix() == pytest.approx(drawn, rel=0.02)


def estimate(method, mps, counts=1, **params):
    """The twist at the second report of wheels that turn evenly."""
    estimator = TwistEstimator(OdometryParams(ppr=40, velocity_method=method, **params))
    totals = [Reading(0, 0, 0), Reading(50_000_000, counts, counts)]
    return estimator.twist(totals, None if method == 'M' else (mps / RADIUS_M, mps / RADIUS_M))


def test_by_counts_two_roundings_and_two_edges_are_uncertain():
    d_m, sigma = math.pi * 0.2 / 40, 0.2
    covariance = estimate('M', 0.3, motion_noise=0.0, encoder={'edge_error': sigma}).covariance
    assert covariance.linear == pytest.approx(2 * (1 / 12 + sigma**2) * (d_m / INTERVAL_S) ** 2 / 2)


def test_by_times_of_edges_two_readings_of_the_clock_are_uncertain():
    """v^2 / (d f) is a tick at a count's distance: docs/encoders.md."""
    d_m, mps, clock_hz = math.pi * 0.2 / 40, 0.3, 2000.0
    covariance = estimate('T', mps, velocity_clock=clock_hz, motion_noise=0.0).covariance
    assert covariance.linear == pytest.approx((mps**2 / (d_m * clock_hz)) ** 2 / 6 / 2)


def test_a_low_pass_of_independent_errors_narrows_them():
    """By share / (2 - share), when it has settled."""
    estimator = TwistEstimator(OdometryParams(ppr=40, velocity_method='T', velocity_low_pass=0.15))
    totals = [Reading(0, 0, 0)]
    for index in range(1, 200):
        totals = [totals[-1], Reading(index * 50_000_000, index, index)]
        twist = estimator.twist(totals, (3.0, 3.0))
    alone = TwistEstimator(OdometryParams(ppr=40, velocity_method='T')).twist(totals, (3.0, 3.0))
    assert twist.covariance.matrix() == pytest.approx(alone.covariance.matrix() * 0.25 / 1.75)


SPEEDS_MPS = (0.0817, 0.3137, 0.8123)  # at 40 PPR a quarter of a count a report, one, and two and a half


@pytest.mark.heavy
@pytest.mark.parametrize('method', ['T', 'MT'])
@pytest.mark.parametrize('mps', SPEEDS_MPS)
@pytest.mark.parametrize(
    'encoder', [{'edge_error': 0.1}, {'sensor': 'hall', 'sensor_error': 6.0}, {'eccentricity': 0.05}, {}]
)
def test_the_covariance_is_that_of_the_speeds_which_encoders_measure(method, mps, encoder):
    """Over 60 encoders; a coarse clock is what is left where edges are in their places."""
    clock_hz, ppr = 2000.0, 42
    turned = np.repeat(mps / RADIUS_M * 1e-9 * TICK_NS * np.arange(150)[:, None], 2, axis=1)
    measured = {'velocity_method': method, 'velocity_clock': clock_hz}
    errors_mps, stated = [], []
    for seed in range(60):
        last = drive(turned, seed, ppr, encoder, **measured)[-10:]
        errors_mps += [estimate.linear_velocity_mps - mps for estimate in last]
        stated += [estimate.twist_covariance[0, 0] for estimate in last]
    ratio = np.mean(np.square(errors_mps)) / np.mean(stated)
    assert 0.4 < ratio < 1.7
