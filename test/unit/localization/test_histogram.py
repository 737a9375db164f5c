"""Bins and clusters of poses, how many particles are drawn, and which ones."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization import particles as histogram
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import kld_limits, particle_statistics, resample


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
    assert histogram.mean_and_covariance(heavy, weights[900:])[1][0, 0] == pytest.approx(heavy[:, 0].var(), rel=1e-9)
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


def test_clusters_are_those_of_a_plain_flood_fill():
    rng = np.random.default_rng(6)
    particles = np.column_stack([rng.uniform(-4, 4, (150, 2)), rng.uniform(-np.pi, np.pi, 150)])
    weights = rng.random(150)
    bins = {tuple(key) for key in np.floor(particles / [0.5, 0.5, math.pi / 18]).astype(int)}
    clusters = 0
    while bins:
        clusters += 1
        pending = [bins.pop()]
        while pending:
            x, y, yaw = pending.pop()
            near = {
                (x + i, y + j, (yaw + k + 18) % 36 - 18) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)
            } & bins
            bins -= near
            pending += near
    assert particle_statistics(particles, weights / weights.sum()).cluster_count == clusters


# A map of four free cells of 5 m.
FREE_CELLS = FreeCells(OccupancyGrid(np.zeros((2, 2), np.int8), 5.0, Pose2D(-2.25, -2.25, 0.0)))


def fixed_count(count):
    return np.full(count + 1, count)


def test_kld_limit_is_the_chi_square_bound():
    """n = chi-square / (2 error) with k - 1 degrees of freedom; Wilson-Hilferty is within 0.2 % of its exact quantiles.

    As upstream, one bin is no bound.
    """
    limits = kld_limits(AmclParams(kld_err=0.01, kld_z=2.3263479, min_particles=1, max_particles=10_000))
    assert limits[[11, 101]] == pytest.approx(np.array([23.209, 135.807]) / (2 * 0.01), rel=2e-3)  # of 99 %
    limits = kld_limits(AmclParams(kld_err=0.02, kld_z=0.99, min_particles=100, max_particles=5000))
    # k = 31: 30 / 0.04 (1 - 2/270 + 0.99 sqrt(2/270))^3 is 939.1.
    assert [limits[k] for k in (0, 1, 2, 31, 5000)] == [5000, 5000, 100, 940, 5000]


def test_particles_stop_when_the_bins_they_fill_have_enough():
    limits = kld_limits(AmclParams(min_particles=10, max_particles=4000, kld_err=0.02))
    rng = np.random.default_rng(0)
    for spread in (0.3, 1.0, 3.0):
        cloud = np.column_stack([rng.normal(0, spread, (4000, 2)), np.zeros(4000)])
        drawn = resample(cloud, np.full(4000, 1 / 4000), limits, 0.0, FREE_CELLS, rng)
        bins = len(np.unique(np.floor(drawn[:, :2] / 0.5), axis=0))
        # Upstream stops at the first particle past the limit.
        assert len(drawn) == min(limits[bins] + 1, 4000)
    one_bin = np.zeros((50, 3)) + 0.1
    assert len(resample(one_bin, np.full(50, 0.02), limits, 0.0, FREE_CELLS, rng)) == 4000


def test_each_particle_is_drawn_as_often_as_its_weight_says():
    """Low variance: n p rounded up or down, where independent draws vary by n p (1 - p)."""
    weights = np.array([0.5, 0.0, 0.3, 0.15, 0.05])
    particles = np.column_stack([np.arange(5.0), np.zeros((5, 2))])
    for count in (7, 3000):
        drawn = resample(particles, weights, fixed_count(count), 0.0, FREE_CELLS, np.random.default_rng(2))
        counts = np.bincount(drawn[:, 0].astype(int), minlength=5)
        assert (np.abs(counts - count * weights) < 1.0 + 1e-9).all()
        assert counts[1] == 0


def test_places_are_those_of_systematic_resampling_and_the_first_of_them_spread_nearly_as_evenly():
    """By the three-gap theorem; of independent places, the largest gap is about log n / n."""
    for count in (1, 10, 4181):
        assert np.sort(histogram.even_places(count, 0.3)) == pytest.approx((np.arange(count) + 0.3) / count)
    for first in (50, 400):
        gaps = np.diff(np.sort(histogram.even_places(3000, 0.0)[:first]), append=1.0)
        assert gaps.max() < 2.0 / first + 1.0 / 3000


def test_the_recovery_fraction_is_drawn_anywhere():
    particles = np.full((10, 3), 0.1)
    drawn = resample(particles, np.full(10, 0.1), fixed_count(40_000), 0.3, FREE_CELLS, np.random.default_rng(4))
    anywhere = drawn[(drawn != 0.1).all(axis=1)]
    assert len(anywhere) / 40_000 == pytest.approx(0.3, abs=0.01)
    centres, counts = np.unique(anywhere[:, :2], axis=0, return_counts=True)
    assert centres.tolist() == [[0.25, 0.25], [0.25, 5.25], [5.25, 0.25], [5.25, 5.25]]
    assert counts / len(anywhere) == pytest.approx([0.25] * 4, abs=0.02)
    headings = np.histogram(anywhere[:, 2], bins=8, range=(-math.pi, math.pi))[0] / len(anywhere)
    assert headings == pytest.approx([1 / 8] * 8, abs=0.02)
