"""Particles: how they are drawn and moved."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization import particles as room
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import decompose, even_normals, move_noise, move_particles


def test_particles_around_a_pose_have_its_mean_and_covariance():
    covariance = np.array([[0.09, 0.05, 0.0], [0.05, 0.04, 0.0], [0.0, 0.0, 0.01]])
    particles = room.particles_around(Pose2D(1.0, -2.0, 0.3), covariance, 100_000, np.random.default_rng(0))
    assert particles.mean(axis=0) == pytest.approx([1.0, -2.0, 0.3], abs=0.005)
    assert np.cov(particles.T) == pytest.approx(covariance, abs=0.001)


DRAWS = 200_000

ALPHAS = dict(odom_alpha1=0.1, odom_alpha2=0.02, odom_alpha3=0.05, odom_alpha4=0.03)


def params(**changes):
    return AmclParams(**{**ALPHAS, **changes})


def draws(model, previous, current, start=(0.0, 0.0, 0.0)):
    particles = np.tile(np.array(start), (DRAWS, 1))
    return move_particles(particles, previous, current, params(odom_model_type=model), np.random.default_rng(1))


def expect(samples, mean, variance):
    """Sample moments lie within five standard errors of a nearly Gaussian quantity's."""
    assert samples.mean() == pytest.approx(mean, abs=5 * math.sqrt(variance / DRAWS) + 1e-12)
    assert samples.var() == pytest.approx(variance, rel=5 * math.sqrt(2.5 / DRAWS), abs=1e-12)


# Variances of (turn, drive, turn) for turn 0.4, drive 0.5, turn -0.3, by table 5.6.
VARIANCES = (0.1 * 0.16 + 0.02 * 0.25, 0.05 * 0.25 + 0.03 * (0.16 + 0.09), 0.1 * 0.09 + 0.02 * 0.25)


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
    end = draws(model, previous, current)
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
    assert move_noise(astern, params()) == pytest.approx(move_noise(ahead, params()))


@pytest.mark.parametrize('turn_rad', [0.3, -1.0])
def test_a_turn_on_the_spot_of_a_base_ahead_of_its_axle_is_a_turn(turn_rad):
    """The axle stands still: the base's end is on a circle about it, and its noise that of the turn alone."""
    base_in_axle = Pose2D(0.1, 0.0, 0.0)
    current = Pose2D(0.0, 0.0, turn_rad).compose(base_in_axle)
    given = params(odom_model_type='diff-corrected', axle_x=-0.1)
    particles = np.tile(np.array(base_in_axle), (DRAWS, 1))
    end = move_particles(particles, base_in_axle, current, given, np.random.default_rng(1))
    expect(end[:, 2], turn_rad, ALPHAS['odom_alpha1'] * turn_rad**2)
    axle = end[:, :2] - 0.1 * np.stack([np.cos(end[:, 2]), np.sin(end[:, 2])], axis=1)
    drive = math.sqrt(ALPHAS['odom_alpha4'] * turn_rad**2)
    assert np.sqrt((axle**2).sum(axis=1).mean()) == pytest.approx(drive, rel=0.02)


def test_normal_draws_are_spread_evenly():
    """Their mean and variance are nearer to 0 and 1 than those of independent draws: by 1 / sqrt(n), sqrt(2 / n)."""
    for seed in range(5):
        normals = even_normals(3000, np.random.default_rng(seed))
        assert normals.mean(axis=0) == pytest.approx([0.0] * 3, abs=0.3 / math.sqrt(3000))
        assert np.cov(normals.T) == pytest.approx(np.eye(3), abs=0.9 / math.sqrt(3000))
    assert np.isfinite(even_normals(1, np.random.default_rng(0))).all()
