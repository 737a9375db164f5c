"""Scan matching and the proposal made from it."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.slam.kernels import climb, gaussian_draw, log_likelihood
from diff_encoder_sim.slam.map_update import update_maps
from diff_encoder_sim.slam.move_noise import apply_moves, move_sigmas
from diff_encoder_sim.slam.patches import Extent, PatchMaps
from diff_encoder_sim.slam.proposal import propose
from diff_encoder_sim.slam.rays import usable_rays
from diff_encoder_sim.slam.systematic_resampling import entropy_of, normalised, systematic_indices
from slam_room import params, room_scan

CELL_M = 0.05


def room_map(particles=1, scans=6, sigma_m=0.01, seed=1):
    """Maps of the room, made from true poses near the origin."""
    rng = np.random.default_rng(seed)
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, particles)
    for _ in range(scans):
        pose = Pose2D(*rng.uniform(-0.3, 0.3, 3).tolist())
        update_maps(
            maps,
            np.tile(np.array(pose), (particles, 1)),
            usable_rays(room_scan(pose, rng, sigma_m), IDENTITY, params()),
        )
    return maps


def match(maps, scan, guess, **changes):
    """Climb from a pose near by; the pose found, in metres."""
    given = params(**changes)
    ends = usable_rays(scan, IDENTITY, given).matched_ends_m() / CELL_M
    start = np.array([(guess.x_m + 4.0) / CELL_M, (guess.y_m + 4.0) / CELL_M, guess.yaw_rad])
    pose, score = climb(
        maps.table[0],
        maps.cells,
        start,
        ends,
        given.kernelSize,
        -(CELL_M**2) / given.sigma,
        given.lstep / CELL_M,
        given.astep,
        given.iterations,
    )
    return Pose2D(pose[0] * CELL_M - 4.0, pose[1] * CELL_M - 4.0, pose[2]), score / len(ends)


def test_a_known_offset_is_recovered():
    """Within 2 mm and 1 mrad, with 1 cm of noise, from a guess 8 cm and 4 degrees off."""
    rng, maps, errors = np.random.default_rng(5), room_map(scans=20), []
    for _ in range(20):
        true = Pose2D(*rng.uniform(-0.3, 0.3, 3).tolist())
        guess = true.compose(Pose2D(0.07, -0.04, 0.07))
        found, score = match(maps, room_scan(true, rng), guess, lskip=0, iterations=7)
        assert score > 0.85
        errors.append(np.subtract(found, true))
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms < [0.002, 0.002, 0.001]).all(), rms
    assert (np.abs(np.mean(errors, axis=0)) < [0.001, 0.001, 0.0005]).all()


def test_along_a_straight_wall_nothing_pulls():
    """Hits of earlier rays must not hold later ones fast: distances are across the wall."""
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, 1)
    bearings = np.linspace(-0.9, 0.9, 60)
    ends = np.column_stack([np.full(60, 1.0), np.tan(bearings)])
    scan = room_scan(IDENTITY, ray_count=60)._replace(
        angle_min_rad=-0.9, angle_increment_rad=1.8 / 59, ranges_m=np.hypot(*ends.T)
    )
    update_maps(maps, np.zeros((1, 3)), usable_rays(scan, IDENTITY, params()))
    inner = ends[20:40] / CELL_M

    def misfit(x_m, y_m):
        return (
            -log_likelihood(
                maps.table[0], maps.cells, np.array([(x_m + 4.0) / CELL_M, (y_m + 4.0) / CELL_M, 0.0]), inner, 1, -1.0
            )
            / 20
        )

    # In cells: a metre is 20.
    assert misfit(0.02, 0.0) == pytest.approx(0.4**2, rel=0.05)
    assert max(misfit(0.0, y_m) for y_m in np.linspace(-0.1, 0.1, 21)) < 0.001


def test_far_from_everything_a_ray_costs_as_much_as_one_looks():
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, 1)
    ends = np.array([[0.0, 0.0], [3.0, 1.0]])
    for kernel in (1, 2):
        assert log_likelihood(
            maps.table[0], maps.cells, np.array([80.0, 80.0, 0.0]), ends, kernel, -0.5
        ) == pytest.approx(-((kernel + 0.5) ** 2))
    outside = np.array([-500.0, 1e6, 0.0])
    assert log_likelihood(maps.table[0], maps.cells, outside, ends, 1, -1.0) == -4.5


def test_sigmas_of_a_move():
    given = params(srr=0.1, srt=0.2, str=0.3, stt=0.4)
    assert move_sigmas(Pose2D(1.0, 0.0, 0.0), given) == pytest.approx([0.1, 0.03, 0.2])
    assert move_sigmas(Pose2D(-1.0, 0.0, -0.5), given) == pytest.approx([0.25, 0.18, 0.4])
    assert (move_sigmas(IDENTITY, given) > 0.0).all()


def test_without_a_match_the_motion_model_is_drawn_from():
    """minimumScore out of reach: mean and spread are odometry's, in the particle's frame."""
    count, move = 4000, Pose2D(0.5, 0.0, 0.2)
    given = params(particles=count, minimumScore=1e9, srr=0.1, srt=0.05, str=0.04, stt=0.1)
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, count)
    start = np.tile([0.3, -0.2, 1.0], (count, 1))
    rays = usable_rays(room_scan(IDENTITY, ray_count=20), IDENTITY, given)
    drawn = propose(maps, start, move, rays, given, np.random.default_rng(6)).particles
    relative = np.array([Pose2D(*pose).relative_to(Pose2D(0.3, -0.2, 1.0)) for pose in drawn.tolist()])
    sigmas = np.array([0.1 * 0.5 + 0.04 * 0.2, 0.03 * 0.5 + 0.04 * 0.2, 0.1 * 0.2 + 0.05 * 0.5])
    assert np.abs(relative.mean(axis=0) - move) == pytest.approx([0, 0, 0], abs=4 * 0.058 / 63)
    assert relative.std(axis=0) == pytest.approx(sigmas, rel=0.05)


def test_the_proposal_follows_the_scan_not_the_odometry():
    """Odometry 6 cm and 3 degrees off: the particles end at the true pose, well weighted."""
    count, rng = 10, np.random.default_rng(7)
    maps, true = room_map(count, scans=15), Pose2D(0.25, 0.1, 0.2)
    given = params(particles=count)
    rays = usable_rays(room_scan(true, rng), IDENTITY, given)
    start = np.zeros((count, 3))
    good = propose(maps, start, true, rays, given, rng)
    bad = propose(maps, start, true.compose(Pose2D(-0.05, 0.03, 0.05)), rays, given, rng)
    for proposed in (good, bad):
        assert (np.abs(proposed.particles - true) < [0.01, 0.01, 0.005]).all()
        assert len(np.unique(proposed.particles[:, 0])) == count
    # The scan fits as well, but it was less to be expected.
    assert np.mean(good.log_factors) > np.mean(bad.log_factors) + 0.5


def test_exact_odometry_outweighs_the_scan():
    """Which the mode of the match alone would not: the proposal holds both."""
    rng, maps = np.random.default_rng(8), room_map(scans=3, sigma_m=0.03)
    given = params(
        particles=1,
        srr=0.0,
        srt=0.0,
        str=0.0,
        stt=0.0,
        lsigma=10.0,
        llsamplerange=0.008,
        lasamplerange=0.004,
        lasamplestep=0.001,
    )
    off = []
    for _ in range(20):
        true = Pose2D(*rng.uniform(-0.2, 0.2, 3).tolist())
        rays = usable_rays(room_scan(true, rng, 0.03), IDENTITY, given)
        drawn = propose(maps, np.zeros((1, 3)), true, rays, given, rng).particles[0]
        off.append(np.abs(drawn - true))
    assert (np.mean(off, axis=0) < [0.002, 0.002, 0.001]).all(), np.mean(off, axis=0)


def test_draws_have_the_moments_of_the_weighted_poses():
    rng = np.random.default_rng(9)
    poses, weights = rng.standard_normal((27, 3)) @ np.diag([1.0, 2.0, 0.1]), rng.random(27)
    weights /= weights.sum()
    draws = np.array([gaussian_draw(poses, weights, normals) for normals in rng.standard_normal((20_000, 3))])
    mean = weights @ poses
    covariance = (poses - mean).T @ ((poses - mean) * weights[:, np.newaxis])
    assert draws.mean(axis=0) == pytest.approx(mean, abs=0.06)
    assert np.cov(draws.T) == pytest.approx(covariance, abs=0.12)
    alone = gaussian_draw(poses[:1], np.ones(1), rng.standard_normal(3))
    assert alone == pytest.approx(poses[0])


def test_moves_are_in_the_particles_frames():
    moved = apply_moves(np.array([[1.0, 2.0, 0.5 * math.pi], [0.0, 0.0, 3.0]]), np.array([0.5, 0.1, 0.3]))
    assert moved[0] == pytest.approx([0.9, 2.5, 0.5 * math.pi + 0.3])
    assert moved[1, 2] == pytest.approx(3.3 - 2.0 * math.pi)


def test_systematic_resampling_keeps_shares():
    weights = np.array([0.05, 0.5, 0.0, 0.25, 0.2])
    counts = np.zeros(5)
    for seed in range(2000):
        indices = systematic_indices(weights, np.random.default_rng(seed))
        assert (np.diff(indices) >= 0).all()
        drawn = np.bincount(indices, minlength=5)
        assert (np.abs(drawn - 5 * weights) < 1.0).all()
        counts += drawn
    assert counts / 10_000 == pytest.approx(weights, abs=0.005)


def test_weights_from_logs_and_their_entropy():
    assert normalised(np.array([-1e6, -1e6])) == pytest.approx([0.5, 0.5])
    assert entropy_of(np.full(30, 1 / 30)) == pytest.approx(math.log(30))
    assert entropy_of(np.array([1.0, 0.0])) == 0.0
