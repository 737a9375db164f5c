"""Scan matching, and the proposal from odometry and scan."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.grid_slam import propose, search_of
from diff_encoder_sim.localization.patches import usable_rays
from diff_encoder_sim.localization.slam_kernels import Search, climb, fit, refine, scan_share
from slam_room import CELL_M, maps_of, params, room_map, room_scan

SEARCH = Search(1, -1e-6, -50.0, 1.0, 0.05, 5, 0.0)
NO_TREND = np.zeros(3)


def test_a_known_offset_is_recovered():
    """Within 2 mm and 1 mrad, with 1 cm of noise, from a guess 8 cm and 4 degrees off."""
    rng, maps, errors = np.random.default_rng(5), room_map(scans=20), []
    given = params(lskip=0, iterations=7)
    for _ in range(20):
        true = Pose2D(*rng.uniform(-0.3, 0.3, 3).tolist())
        guess = true.compose(Pose2D(0.07, -0.04, 0.07))
        ends = usable_rays(room_scan(true, rng), IDENTITY, given).matched_ends_m() / CELL_M
        start = np.array([(guess.x_m + 4.0) / CELL_M, (guess.y_m + 4.0) / CELL_M, guess.yaw_rad])
        pose, score = climb(maps.table[0], maps.cells, start, ends, search_of(given, CELL_M))
        assert score > 0.85 * len(ends)
        errors.append(np.array([pose[0] * CELL_M - 4.0, pose[1] * CELL_M - 4.0, pose[2]]) - true)
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert (rms < [0.002, 0.002, 0.001]).all(), rms
    assert (np.abs(np.mean(errors, axis=0)) < [0.001, 0.001, 0.0005]).all()


def test_a_straight_wall_pulls_across_it_and_not_along_it():
    """Hits of earlier rays must not hold later ones fast; the information in closed form."""
    maps, bearings = maps_of(1), np.linspace(-0.9, 0.9, 60)
    rays = dict(angle_min_rad=-0.9, angle_increment_rad=1.8 / 59, ranges_m=1.0 / np.cos(bearings))
    scan = room_scan(IDENTITY, ray_count=60)._replace(**rays)
    maps.update(np.zeros((1, 3)), usable_rays(scan, IDENTITY, params()))  # 1 m ahead of the origin
    ends = np.column_stack([np.full(20, 1.0), np.linspace(-0.3, 0.3, 20)]) / CELL_M

    def misfit(x_m, y_m):
        pose = np.array([(x_m + 4.0) / CELL_M, (y_m + 4.0) / CELL_M, 0.0])
        return -fit(maps.table[0], maps.cells, pose, ends, SEARCH._replace(likelihood_scale=-1.0))[1] / 20

    # In cells: a metre is 20.
    assert misfit(0.02, 0.0) == pytest.approx(0.4**2, rel=0.05)
    assert max(misfit(0.0, y_m) for y_m in np.linspace(-0.1, 0.1, 21)) < 0.001
    # n rays at lsigma across the wall, odometry's alone along it.
    expected, sigmas = np.array([80.1, 80.2, 0.003]), np.array([1.0, 2.0, 0.01])
    mode, root = refine(maps.table[0], maps.cells, expected, expected, ends, SEARCH, sigmas)
    information = root @ root.T
    assert information[0, 0] == pytest.approx(20 * 2 * 50.0 + 1.0, rel=0.01)
    assert information[1, 1] == pytest.approx(0.25, rel=0.05)
    assert information[2, 2] == pytest.approx(2 * 50.0 * (ends[:, 1] ** 2).sum() + 0.01**-2, rel=0.02)
    # Onto the wall, and along it where odometry says.
    assert mode == pytest.approx([80.0, 80.2, 0.0], abs=0.01)


def test_only_what_exceeds_the_noise_of_the_scan_is_taken():
    """The share is 1 - 7.81 / squared way in standard deviations, at least 0; the trend's variance is 1 / 19."""
    way, none = np.array([1.5, -3.0, 2.0]), np.zeros(3)
    assert scan_share(way, none) == pytest.approx(1.0 - 7.81 / 15.25)
    assert scan_share(none, way) == pytest.approx(1.0 - 7.81 / (19.0 * 15.25))
    assert scan_share(0.7 * way, 0.1 * way) == scan_share(none, none) == 0.0
    # The noise of a scan alone speaks against odometry once in twenty.
    noise = np.random.default_rng(1).standard_normal((20000, 3))
    assert np.mean([scan_share(way, none) > 0.0 for way in noise]) == pytest.approx(0.05, abs=0.005)


def test_without_a_match_the_motion_model_is_drawn_from():
    """minimumScore out of reach: mean and spread are odometry's, in the particle's frame."""
    count, move = 4000, Pose2D(0.5, 0.0, 0.2)
    given = params(particles=count, minimumScore=1e6, srr=0.1, srt=0.05, str=0.04, stt=0.1)
    start = np.tile([0.3, -0.2, 1.0], (count, 1))
    rays = usable_rays(room_scan(IDENTITY, ray_count=20), IDENTITY, given)
    drawn = propose(maps_of(count), start, move, rays, given, np.random.default_rng(6), NO_TREND)[0]
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
    (good, good_logs, _, _), (bad, bad_logs, _, _) = (
        propose(maps, np.zeros((count, 3)), true.compose(off), rays, given, rng, NO_TREND)
        for off in (IDENTITY, Pose2D(-0.05, 0.03, 0.05))
    )
    for particles in (good, bad):
        assert (np.abs(particles - true) < [0.01, 0.01, 0.005]).all()
    # Odometry that the scan does not contradict is kept as it is; else each particle draws a pose of its own.
    assert good == pytest.approx(np.tile(np.array(true), (count, 1)))
    assert len(np.unique(bad[:, 0])) == count
    # The scan fits as well, but it was less to be expected.
    assert np.mean(good_logs) > np.mean(bad_logs) + 0.5


def test_exact_odometry_outweighs_the_scan():
    rng, maps, off = np.random.default_rng(8), room_map(scans=3, sigma_m=0.03), []
    given = params(particles=1, srr=0.0, srt=0.0, str=0.0, stt=0.0, lsigma=10.0)
    for _ in range(20):
        true = Pose2D(*rng.uniform(-0.2, 0.2, 3).tolist())
        rays = usable_rays(room_scan(true, rng, 0.03), IDENTITY, given)
        off.append(np.abs(propose(maps, np.zeros((1, 3)), true, rays, given, rng, NO_TREND)[0][0] - true))
    assert (np.mean(off, axis=0) < [0.002, 0.002, 0.001]).all(), np.mean(off, axis=0)


def test_a_small_error_of_every_step_is_found():
    """An offset that the noise of one scan hides: at first odometry is kept, then the scan corrects it."""
    rng, maps = np.random.default_rng(10), room_map(scans=30)
    given, off, trend = params(particles=1), Pose2D(0.0, 0.0, 0.0014), NO_TREND
    turned_rad = []
    for _ in range(25):
        true = Pose2D(*rng.uniform(-0.2, 0.2, 3).tolist())
        rays = usable_rays(room_scan(true, rng), IDENTITY, given)
        particles, _, _, trend = propose(maps, np.zeros((1, 3)), true.compose(off), rays, given, rng, trend)
        turned_rad.append(particles[0, 2] - true.yaw_rad)
    assert turned_rad[0] == pytest.approx(off.yaw_rad, abs=1e-9)
    assert abs(np.mean(turned_rad[-10:])) < 0.6 * off.yaw_rad
