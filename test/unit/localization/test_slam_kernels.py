"""Scan matching, and drawing from weighted poses."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.map_update import update_maps, usable_rays
from diff_encoder_sim.localization.patches import Extent, PatchMaps
from diff_encoder_sim.localization.proposal import search_of
from diff_encoder_sim.localization.slam_kernels import Search, climb, log_likelihood, refine, scan_share
from slam_maps import CELL_M, room_map
from slam_room import params, room_scan

SEARCH = Search(1, -1e-6, -50.0, 1.0, 0.05, 5, 0.0)


def match(maps, scan, guess, **changes):
    """Climb from a pose near by; the pose found, in metres."""
    given = params(**changes)
    ends = usable_rays(scan, IDENTITY, given).matched_ends_m() / CELL_M
    start = np.array([(guess.x_m + 4.0) / CELL_M, (guess.y_m + 4.0) / CELL_M, guess.yaw_rad])
    pose, score = climb(maps.table[0], maps.cells, start, ends, search_of(given, CELL_M))
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
        pose = np.array([(x_m + 4.0) / CELL_M, (y_m + 4.0) / CELL_M, 0.0])
        return -log_likelihood(maps.table[0], maps.cells, pose, inner, SEARCH._replace(likelihood_scale=-1.0)) / 20

    # In cells: a metre is 20.
    assert misfit(0.02, 0.0) == pytest.approx(0.4**2, rel=0.05)
    assert max(misfit(0.0, y_m) for y_m in np.linspace(-0.1, 0.1, 21)) < 0.001


def test_the_information_of_a_wall_is_across_it():
    """In closed form: n rays at lsigma across the wall, odometry's alone along it."""
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, 1)
    bearings = np.linspace(-0.9, 0.9, 60)
    scan = room_scan(IDENTITY, ray_count=60)._replace(
        angle_min_rad=-0.9, angle_increment_rad=1.8 / 59, ranges_m=1.0 / np.cos(bearings)
    )
    update_maps(maps, np.zeros((1, 3)), usable_rays(scan, IDENTITY, params()))
    ends = np.column_stack([np.full(20, 1.0), np.linspace(-0.3, 0.3, 20)]) / CELL_M
    expected, sigmas = np.array([80.1, 80.2, 0.003]), np.array([1.0, 2.0, 0.01])
    mode, root = refine(maps.table[0], maps.cells, expected, expected, ends, SEARCH, sigmas)
    information = root @ root.T
    assert information[0, 0] == pytest.approx(20 * 2 * 50.0 + 1.0, rel=0.01)
    assert information[1, 1] == pytest.approx(0.25, rel=0.05)
    assert information[2, 2] == pytest.approx(2 * 50.0 * (ends[:, 1] ** 2).sum() + 0.01**-2, rel=0.02)
    # Onto the wall, and along it where odometry says.
    assert mode == pytest.approx([80.0, 80.2, 0.0], abs=0.01)


def test_the_noise_of_a_scan_alone_speaks_against_odometry_once_in_twenty():
    noise = np.random.default_rng(1).standard_normal((20000, 3))
    shares = np.array([scan_share(way, np.zeros(3)) for way in noise])
    assert (shares > 0.0).mean() == pytest.approx(0.05, abs=0.005)


def test_only_what_exceeds_the_noise_of_the_scan_is_taken():
    """The share is 1 - 7.81 / squared way in standard deviations, at least 0; the trend's variance is 1 / 19."""
    way, none = np.array([1.5, -3.0, 2.0]), np.zeros(3)
    assert scan_share(way, none) == pytest.approx(1.0 - 7.81 / 15.25)
    assert scan_share(none, way) == pytest.approx(1.0 - 7.81 / (19.0 * 15.25))
    assert scan_share(0.7 * way, 0.1 * way) == scan_share(none, none) == 0.0
