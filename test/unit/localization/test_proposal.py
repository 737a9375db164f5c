"""The proposal from odometry and scan."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.map_update import usable_rays
from diff_encoder_sim.localization.patches import Extent, PatchMaps
from diff_encoder_sim.localization.proposal import propose
from slam_maps import CELL_M, room_map
from slam_room import params, room_scan

NO_TREND = np.zeros(3)


def test_without_a_match_the_motion_model_is_drawn_from():
    """minimumScore out of reach: mean and spread are odometry's, in the particle's frame."""
    count, move = 4000, Pose2D(0.5, 0.0, 0.2)
    given = params(particles=count, minimumScore=1e6, srr=0.1, srt=0.05, str=0.04, stt=0.1)
    maps = PatchMaps(Extent(-4.0, -4.0, 4.0, 4.0), CELL_M, count)
    start = np.tile([0.3, -0.2, 1.0], (count, 1))
    rays = usable_rays(room_scan(IDENTITY, ray_count=20), IDENTITY, given)
    drawn = propose(maps, start, move, rays, given, np.random.default_rng(6), NO_TREND).particles
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
    good = propose(maps, start, true, rays, given, rng, NO_TREND)
    bad = propose(maps, start, true.compose(Pose2D(-0.05, 0.03, 0.05)), rays, given, rng, NO_TREND)
    for proposed in (good, bad):
        assert (np.abs(proposed.particles - true) < [0.01, 0.01, 0.005]).all()
    # Odometry that the scan does not contradict is kept as it is; else each particle draws a pose of its own.
    assert good.particles == pytest.approx(np.tile(np.array(true), (count, 1)))
    assert len(np.unique(bad.particles[:, 0])) == count
    # The scan fits as well, but it was less to be expected.
    assert np.mean(good.log_factors) > np.mean(bad.log_factors) + 0.5


def test_exact_odometry_outweighs_the_scan():
    """Which the mode of the match alone would not: the proposal holds both."""
    rng, maps = np.random.default_rng(8), room_map(scans=3, sigma_m=0.03)
    given = params(particles=1, srr=0.0, srt=0.0, str=0.0, stt=0.0, lsigma=10.0)
    off = []
    for _ in range(20):
        true = Pose2D(*rng.uniform(-0.2, 0.2, 3).tolist())
        rays = usable_rays(room_scan(true, rng, 0.03), IDENTITY, given)
        drawn = propose(maps, np.zeros((1, 3)), true, rays, given, rng, NO_TREND).particles[0]
        off.append(np.abs(drawn - true))
    assert (np.mean(off, axis=0) < [0.002, 0.002, 0.001]).all(), np.mean(off, axis=0)


def test_a_small_error_of_every_step_is_found():
    """An offset that the noise of one scan hides: at first odometry is kept, then the scan corrects it."""
    rng, maps = np.random.default_rng(10), room_map(scans=30)
    given, off, trend = params(particles=1), Pose2D(0.0, 0.0, 0.0014), NO_TREND
    turned_rad = []
    for _ in range(25):
        true = Pose2D(*rng.uniform(-0.2, 0.2, 3).tolist())
        rays = usable_rays(room_scan(true, rng), IDENTITY, given)
        proposed = propose(maps, np.zeros((1, 3)), true.compose(off), rays, given, rng, trend)
        trend = proposed.trend
        turned_rad.append(proposed.particles[0, 2] - true.yaw_rad)
    assert turned_rad[0] == pytest.approx(off.yaw_rad, abs=1e-9)
    assert abs(np.mean(turned_rad[-10:])) < 0.6 * off.yaw_rad
