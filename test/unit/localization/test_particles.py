"""Particles: how they are sampled, moved, counted in bins, clustered and resampled."""

import itertools
import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization import particles as room
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import decompose, kld_limits, particle_statistics, resample

DRAWS = 200_000
ALPHAS = dict(odom_alpha1=0.1, odom_alpha2=0.02, odom_alpha3=0.05, odom_alpha4=0.03)
# Variances of (turn, drive, turn) for turn 0.4, drive 0.5, turn -0.3, by table 5.6.
VARIANCES = (0.1 * 0.16 + 0.02 * 0.25, 0.05 * 0.25 + 0.03 * (0.16 + 0.09), 0.1 * 0.09 + 0.02 * 0.25)
# A map of four free cells of 5 m.
FREE_CELLS = FreeCells(OccupancyGrid(np.zeros((2, 2), np.int8), 5.0, Pose2D(-2.25, -2.25, 0.0)))


def test_particles_around_a_pose_have_its_mean_and_covariance():
    covariance = np.array([[0.09, 0.05, 0.0], [0.05, 0.04, 0.0], [0.0, 0.0, 0.01]])
    particles = room.particles_around(Pose2D(1.0, -2.0, 0.3), covariance, 100_000, np.random.default_rng(0))
    assert particles.mean(axis=0) == pytest.approx([1.0, -2.0, 0.3], abs=0.005)
    assert np.cov(particles.T) == pytest.approx(covariance, abs=0.001)


def draws(previous, current, start=(0.0, 0.0, 0.0), **changes):
    particles, given = np.tile(np.array(start), (DRAWS, 1)), AmclParams(**ALPHAS, **changes)
    return room.move_particles(particles, previous, current, given, np.random.default_rng(1))


def expect(samples, mean, variance):
    """Sample moments lie within five standard errors of a nearly Gaussian quantity's."""
    assert samples.mean() == pytest.approx(mean, abs=5 * math.sqrt(variance / DRAWS) + 1e-12)
    assert samples.var() == pytest.approx(variance, rel=5 * math.sqrt(2.5 / DRAWS), abs=1e-12)


@pytest.mark.parametrize(
    ('model', 'sigmas'),
    [
        ('diff-corrected', [math.sqrt(variance) for variance in VARIANCES]),
        ('diff', VARIANCES),  # upstream's: the variance taken for a standard deviation
    ],
)
def test_moments_of_turn_drive_turn(model, sigmas):
    """E cos and E cos^2 of a Gaussian angle give the mean and variance of the end point."""
    previous = Pose2D(1.0, -2.0, 0.7)
    current = previous.compose(Pose2D(0.5 * math.cos(0.4), 0.5 * math.sin(0.4), 0.1))
    end = draws(previous, current, odom_model_type=model)
    turn1, drive, turn2 = sigmas
    shrink, shrink_twice = math.exp(-(turn1**2) / 2), math.exp(-2 * turn1**2)
    mean_x, mean_y = 0.5 * shrink * math.cos(0.4), 0.5 * shrink * math.sin(0.4)
    square = 0.25 + drive**2
    expect(end[:, 0], mean_x, square * (1 + shrink_twice * math.cos(0.8)) / 2 - mean_x**2)
    expect(end[:, 1], mean_y, square * (1 - shrink_twice * math.cos(0.8)) / 2 - mean_y**2)
    expect(end[:, 2], 0.1, turn1**2 + turn2**2)
    # Only the first turn bends the path; it goes into the final heading as well. Where noise turns the drive
    # backwards, the end point lies on the same line, behind.
    bent = (np.arctan2(end[:, 1], end[:, 0]) - 0.4 + math.pi / 2) % math.pi - math.pi / 2
    expect(bent, 0.0, turn1**2)
    assert np.cov(bent, end[:, 2])[0, 1] == pytest.approx(turn1**2, rel=0.03)


def test_a_small_translation_has_no_direction_and_reversing_is_as_noisy_as_driving_ahead():
    for y_m, turn_rad in ((0.0099, 0.0), (0.0101, math.pi / 2)):
        assert decompose(IDENTITY, Pose2D(0.0, y_m, 0.2)) == pytest.approx((turn_rad, y_m, 0.2 - turn_rad))
    ahead, astern = (decompose(IDENTITY, Pose2D(x_m, 0.0, 0.0)) for x_m in (0.5, -0.5))
    assert abs(astern.rotation1_rad) == pytest.approx(math.pi)
    assert room.move_noise(astern, AmclParams(**ALPHAS)) == pytest.approx(room.move_noise(ahead, AmclParams(**ALPHAS)))


@pytest.mark.parametrize('turn_rad', [0.3, -1.0])
def test_a_turn_on_the_spot_of_a_base_ahead_of_its_axle_is_a_turn(turn_rad):
    """The axle stands still: the base's end is on a circle about it, and its noise that of the turn alone."""
    base_in_axle = Pose2D(0.1, 0.0, 0.0)
    current = Pose2D(0.0, 0.0, turn_rad).compose(base_in_axle)
    end = draws(base_in_axle, current, base_in_axle, odom_model_type='diff-corrected', axle_x=-0.1)
    expect(end[:, 2], turn_rad, ALPHAS['odom_alpha1'] * turn_rad**2)
    axle = end[:, :2] - 0.1 * np.stack([np.cos(end[:, 2]), np.sin(end[:, 2])], axis=1)
    drive = math.sqrt(ALPHAS['odom_alpha4'] * turn_rad**2)
    assert np.sqrt((axle**2).sum(axis=1).mean()) == pytest.approx(drive, rel=0.02)


def test_normal_draws_are_spread_evenly():
    """Their mean and variance are nearer to 0 and 1 than those of independent draws: by 1 / sqrt(n), sqrt(2 / n)."""
    for seed in range(5):
        normals = room.even_normals(3000, np.random.default_rng(seed))
        assert normals.mean(axis=0) == pytest.approx([0.0] * 3, abs=0.3 / math.sqrt(3000))
        assert np.cov(normals.T) == pytest.approx(np.eye(3), abs=0.9 / math.sqrt(3000))
    assert np.isfinite(room.even_normals(1, np.random.default_rng(0))).all()


def cloud(rng, centre, count, sigma=0.05):
    return np.array(centre) + sigma * rng.standard_normal((count, 3))


def test_the_heaviest_cluster_is_the_estimate():
    """By weight, not by number; the spread is that of all particles, as upstream publishes it."""
    rng = np.random.default_rng(5)
    light, heavy = cloud(rng, (0.0, 0.0, 0.0), 900), cloud(rng, (5.0, 2.0, 1.0), 100)
    particles = np.vstack([light, heavy])
    weights = np.concatenate([np.full(900, 0.4 / 900), np.full(100, 0.6 / 100)])
    mean, covariance = particle_statistics(particles, weights)
    assert mean == pytest.approx(heavy.mean(axis=0), abs=1e-3)
    assert room.mean_and_covariance(heavy, weights[900:])[1][0, 0] == pytest.approx(heavy[:, 0].var(), rel=1e-9)
    assert covariance[0, 0] == pytest.approx(0.24 * 25.0, rel=0.02)


def test_clusters_reach_around_half_a_turn():
    """Where upstream cuts a cluster in two at +-180 degrees."""
    yaw = np.array([3.1, 3.12, -3.1, -3.13])
    mean, covariance = particle_statistics(np.column_stack([np.zeros((4, 2)), yaw]), np.full(4, 0.25))
    assert covariance[2, 2] < 0.01
    assert abs(mean.yaw_rad) == pytest.approx(np.mean(yaw % (2 * math.pi)), abs=1e-3)


def test_clusters_are_those_of_a_plain_flood_fill():
    rng = np.random.default_rng(6)
    particles = np.column_stack([rng.uniform(-4, 4, (150, 2)), rng.uniform(-np.pi, np.pi, 150)])
    bins, clusters = {tuple(key) for key in np.floor(particles / [0.5, 0.5, math.pi / 18]).astype(int)}, 0
    while bins:
        clusters += 1
        pending = [bins.pop()]
        while pending:
            x, y, yaw = pending.pop()
            steps = itertools.product((-1, 0, 1), repeat=3)
            near = {(x + i, y + j, (yaw + k + 18) % 36 - 18) for i, j, k in steps} & bins
            bins -= near
            pending += near
    assert room.cluster_labels(particles).max() + 1 == clusters


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
        assert np.sort(room.even_places(count, 0.3)) == pytest.approx((np.arange(count) + 0.3) / count)
    for first in (50, 400):
        gaps = np.diff(np.sort(room.even_places(3000, 0.0)[:first]), append=1.0)
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
