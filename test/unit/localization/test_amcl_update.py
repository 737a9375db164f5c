"""When the filter updates, what restarts it, and when estimates come."""

import math

import numpy as np
import pytest

from amcl_filters import NO_MOTION_LIMIT, amcl, run
from amcl_world import START, pillar_room
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D


def test_estimates_come_on_the_first_update_and_each_second(drive):
    estimates = run(amcl(), drive[:7])
    assert [estimate is not None for estimate in estimates] == [True, True, False, True, False, True, False]
    every = run(amcl(resample_interval=1), drive[:4])
    assert all(every)


def test_the_first_estimate_is_the_initial_pose(drive):
    """As upstream's: the mean of the particles as they began."""
    first = amcl().update(drive[0][1], drive[0][2], IDENTITY)
    assert np.subtract(first.base_pose_in_map, START) == pytest.approx(0, abs=0.05)
    assert np.sqrt(np.diag(first.covariance)) == pytest.approx([0.5, 0.5, math.pi / 12], rel=0.05)


def test_it_updates_only_when_the_robot_has_moved(drive):
    """By update_min_d along x or along y, or update_min_a; each as far as it may go without."""
    scan = drive[0][2]
    filter_ = amcl()
    filter_.update(IDENTITY, scan, IDENTITY)
    before = filter_.particles
    for pose in (Pose2D(0.199, -0.199, 0.0), Pose2D(-0.199, 0.0, math.radians(29.9))):
        assert filter_.update(pose, scan, IDENTITY) is None
        assert filter_.particles is before and filter_.update_count == 1
    for count, pose in enumerate((Pose2D(0.201, 0, 0), Pose2D(0.201, -0.21, 0), Pose2D(0.201, -0.21, -0.53))):
        filter_.update(pose, scan, IDENTITY)
        assert filter_.update_count == count + 2


def test_an_update_can_be_requested_without_motion(drive):
    scan = drive[0][2]
    filter_ = amcl()
    filter_.update(IDENTITY, scan, IDENTITY)
    filter_.request_nomotion_update()
    assert filter_.update(IDENTITY, scan, IDENTITY) is not None
    assert filter_.update(IDENTITY, scan, IDENTITY) is None


def test_a_requested_update_outlives_a_new_pose(drive):
    """As upstream: the first scan after it updates anyway, so the request is for the second."""
    filter_ = amcl()
    filter_.request_nomotion_update()
    filter_.set_pose(START, 0.01 * np.eye(3))
    for _ in range(4):
        filter_.update(IDENTITY, drive[0][2], IDENTITY)
    assert filter_.update_count == 2


def test_weights_last_from_one_resampling_to_the_next(drive):
    """As in Noetic: two scans on the spot multiply."""
    scan = drive[0][2]
    filter_ = amcl(resample_interval=100, **NO_MOTION_LIMIT)
    filter_.update(IDENTITY, scan, IDENTITY)
    once = filter_.weights
    filter_.request_nomotion_update()
    filter_.update(IDENTITY, scan, IDENTITY)
    assert filter_.weights == pytest.approx(once**2 / (once**2).sum())


def test_selective_resampling_keeps_particles_that_still_count(drive):
    estimates = run(amcl(selective_resampling=True, laser_max_beams=2), drive[:4])
    assert len(estimates[1].particles) == 3000 and np.ptp(estimates[1].weights) > 0
    plain = run(amcl(laser_max_beams=2), drive[:4])
    assert np.ptp(plain[1].weights) == 0


def test_a_new_pose_begins_again(drive):
    filter_ = amcl()
    run(filter_, drive[:5])
    filter_.set_pose(Pose2D(-1.0, 1.5, 3.0), np.diag([0.01, 0.04, 0.0025]))
    assert len(filter_.particles) == 3000
    assert filter_.particles[:, :2].mean(axis=0) == pytest.approx([-1.0, 1.5], abs=0.02)
    assert filter_.particles[:, :2].std(axis=0) == pytest.approx([0.1, 0.2], rel=0.06)
    estimate = filter_.update(drive[5][1], drive[5][2], IDENTITY)
    assert estimate.base_pose_in_map == pytest.approx((-1.0, 1.5, 3.0), abs=0.02)


def test_a_correlated_initial_covariance_is_kept(drive):
    covariance = np.array([[0.09, 0.05, 0.0], [0.05, 0.04, 0.0], [0.0, 0.0, 0.01]])
    filter_ = amcl(max_particles=50_000)
    filter_.set_pose(IDENTITY, covariance)
    assert np.cov(filter_.particles.T) == pytest.approx(covariance, abs=0.002)


@pytest.mark.parametrize(
    ('flag', 'restart'),
    [
        ('force_update_after_initialpose', lambda f: f.set_pose(START, np.eye(3) * 0.01)),
        ('force_update_after_set_map', lambda f: f.set_map(pillar_room())),
    ],
)
def test_upstreams_flags_force_a_second_update(drive, flag, restart):
    """The first scan after a restart updates anyway."""
    for value, updates in ((False, 1), (True, 2)):
        filter_ = amcl(**{flag: value})
        restart(filter_)
        for _ in range(4):
            filter_.update(IDENTITY, drive[0][2], IDENTITY)
        assert filter_.update_count == updates


def test_particles_anywhere_are_on_free_cells():
    grid = pillar_room()
    filter_ = amcl(grid=grid)
    filter_.global_localization()
    cells = [grid.cell_at(x, y) for x, y in filter_.particles[:, :2]]
    assert all(grid.cells[row, column] == 0 for row, column in cells)
    assert filter_.particles[:, 2].std() == pytest.approx(2 * math.pi / math.sqrt(12), rel=0.05)
