"""The pose estimate and its covariance from weighted particles."""

import math

import numpy as np
import pytest

from diff_encoder_sim.localization.histogram import mean_and_covariance, particle_statistics


def cloud(rng, centre, count, sigma=0.05):
    return np.array(centre) + sigma * rng.standard_normal((count, 3))


def test_the_heaviest_cluster_is_the_estimate():
    """By weight, not by number; the spread is that of all particles, as upstream publishes it."""
    rng = np.random.default_rng(5)
    light, heavy = cloud(rng, (0.0, 0.0, 0.0), 900), cloud(rng, (5.0, 2.0, 1.0), 100)
    particles = np.vstack([light, heavy])
    weights = np.concatenate([np.full(900, 0.4 / 900), np.full(100, 0.6 / 100)])
    statistics = particle_statistics(particles, weights)
    assert statistics.mean == pytest.approx(heavy.mean(axis=0), abs=1e-3)
    assert statistics.cluster_weight == pytest.approx(0.6)
    assert statistics.cluster_count == 2
    assert mean_and_covariance(heavy, weights[900:]).covariance[0, 0] == pytest.approx(heavy[:, 0].var(), rel=1e-9)
    assert statistics.covariance[0, 0] == pytest.approx(0.24 * 25.0, rel=0.02)


def test_clusters_reach_around_half_a_turn():
    """Where upstream cuts a cluster in two at +-180 degrees."""
    yaw = np.array([3.1, 3.12, -3.1, -3.13])
    statistics = particle_statistics(np.column_stack([np.zeros((4, 2)), yaw]), np.full(4, 0.25))
    assert statistics.cluster_count == 1
    assert abs(statistics.mean.yaw_rad) == pytest.approx(
        np.mean([3.1, 3.12, 2 * math.pi - 3.1, 2 * math.pi - 3.13]), abs=1e-3
    )
    assert statistics.covariance[2, 2] < 0.01


def test_covariance_of_a_known_gaussian():
    rng = np.random.default_rng(7)
    covariance = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.0], [0.0, 0.0, 0.06]])
    draws = rng.multivariate_normal([1000.0, -2000.0, 3.1], covariance, 100_000)
    mean, measured = mean_and_covariance(draws, np.ones(100_000))
    assert mean == pytest.approx((1000.0, -2000.0, 3.1), abs=0.005)
    assert measured == pytest.approx(covariance, abs=0.001)


def test_covariance_stays_a_number_at_its_ends():
    same = np.zeros((5, 3)) + 0.3
    assert mean_and_covariance(same, np.full(5, 0.2)).covariance == pytest.approx(0, abs=1e-12)
    opposite = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -math.pi]])
    assert np.isfinite(mean_and_covariance(opposite, np.full(2, 0.5)).covariance).all()
