"""The odometry models' moments against their closed forms."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import (
    Move,
    decompose,
    diff_corrected_noise,
    diff_noise,
    motion_model,
    sample_motion,
)

DRAWS = 200_000
ALPHAS = dict(odom_alpha1=0.1, odom_alpha2=0.02, odom_alpha3=0.05, odom_alpha4=0.03)


def params(**changes):
    return AmclParams(**{**ALPHAS, **changes})


def draws(model, previous, current, start=(0.0, 0.0, 0.0)):
    particles = np.tile(np.array(start), (DRAWS, 1))
    return motion_model(params(odom_model_type=model))(particles, previous, current, np.random.default_rng(1))


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
    # Only the first turn bends the path; it goes into the final heading as well.
    # (Where noise turns the drive backwards, the end point lies on the same line, behind.)
    bent = (np.arctan2(end[:, 1], end[:, 0]) - 0.4 + math.pi / 2) % math.pi - math.pi / 2
    expect(bent, 0.0, turn1**2)
    assert np.cov(bent, end[:, 2])[0, 1] == pytest.approx(turn1**2, rel=0.03)


def test_particles_move_along_their_own_headings():
    end = draws('diff', Pose2D(0, 0, 0), Pose2D(1, 0, 0), start=(3.0, 4.0, math.pi / 2))
    assert end.mean(axis=0) == pytest.approx([3.0, 5.0, math.pi / 2], abs=0.002)


@pytest.mark.parametrize('model', ['diff', 'diff-corrected'])
def test_standing_still_adds_no_noise(model):
    end = draws(model, Pose2D(1, 2, 3), Pose2D(1, 2, 3), start=(5.0, 6.0, 1.0))
    assert end == pytest.approx(np.tile([5.0, 6.0, 1.0], (DRAWS, 1)))


def test_turning_on_the_spot_shifts_the_robot_by_alpha4():
    end = draws('diff-corrected', Pose2D(0, 0, 1.0), Pose2D(0, 0, 1.6))
    expect(end[:, 0], 0.0, 0.03 * 0.36)
    expect(end[:, 1], 0.0, 0.0)
    expect(end[:, 2], 0.6, 0.1 * 0.36)


def test_a_small_translation_has_no_direction():
    sideways = Pose2D(0.0, 0.0099, 0.2)
    assert decompose(Pose2D(0, 0, 0), sideways) == pytest.approx((0.0, 0.0099, 0.2))
    assert decompose(Pose2D(0, 0, 0), Pose2D(0.0, 0.0101, 0.2)) == pytest.approx(
        (math.pi / 2, 0.0101, 0.2 - math.pi / 2)
    )


def test_reversing_is_as_noisy_as_driving_ahead():
    ahead = decompose(Pose2D(0, 0, 0), Pose2D(0.5, 0.0, 0.0))
    astern = decompose(Pose2D(0, 0, 0), Pose2D(-0.5, 0.0, 0.0))
    assert abs(astern.rotation1_rad) == pytest.approx(math.pi)
    for noise in (diff_noise, diff_corrected_noise):
        assert noise(astern, params()) == pytest.approx(noise(ahead, params()))


def test_diff_takes_the_variance_for_the_standard_deviation():
    move = Move(0.4, 0.5, -0.3)
    assert diff_noise(move, params()) == pytest.approx(VARIANCES)
    assert diff_corrected_noise(move, params()) == pytest.approx(np.sqrt(VARIANCES))


def test_headings_stay_in_range_and_equal_seeds_in_step():
    start = np.column_stack([np.zeros((1000, 2)), np.linspace(-math.pi, 3.14, 1000)])
    results = []
    for move in (Move(3.0, 0.1, 3.0), Move(0.0, 0.0, 0.0)):
        rng = np.random.default_rng(2)
        end = sample_motion(start, move, Move(1.0, 1.0, 1.0), rng)
        assert (end[:, 2] >= -math.pi).all() and (end[:, 2] < math.pi).all()
        results.append(rng.random())
    assert results[0] == results[1]


@pytest.mark.parametrize('turn_rad', [0.3, -1.0])
def test_a_turn_on_the_spot_of_a_base_ahead_of_its_axle_is_a_turn(turn_rad):
    """The axle stands still: the base's end is on a circle about it, and its noise that of the turn alone."""
    behind = Pose2D(-0.1, 0.0, 0.0)
    base_in_axle = Pose2D(0.1, 0.0, 0.0)
    current = Pose2D(0.0, 0.0, turn_rad).compose(base_in_axle)
    model = motion_model(params(odom_model_type='diff-corrected', axle_x=behind.x_m))
    particles = np.tile(np.array(tuple(base_in_axle)), (DRAWS, 1))
    end = model(particles, base_in_axle, current, np.random.default_rng(1))
    variance = ALPHAS['odom_alpha1'] * turn_rad**2
    expect(end[:, 2], turn_rad, variance)
    drive = math.sqrt(ALPHAS['odom_alpha4'] * turn_rad**2)
    axle = end[:, :2] - 0.1 * np.stack([np.cos(end[:, 2]), np.sin(end[:, 2])], axis=1)
    assert np.sqrt((axle**2).sum(axis=1).mean()) == pytest.approx(drive, rel=0.02)
    assert np.isfinite(end).all()


def test_on_the_axle_nothing_changes():
    previous, current = Pose2D(1.0, -2.0, 0.7), Pose2D(1.3, -1.9, 0.9)
    particles = np.random.default_rng(2).uniform(-1.0, 1.0, (50, 3))
    ends = [
        motion_model(params(**changes))(particles, previous, current, np.random.default_rng(3))
        for changes in ({}, {'axle_x': 0.0})
    ]
    assert (ends[0] == ends[1]).all()
