"""Bad scans, poses and maps are refused, and leave the filter as it was."""

import math

import numpy as np
import pytest

from amcl_filters import NO_MOTION_LIMIT, amcl, run
from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid

NAN_POSE = Pose2D(math.nan, 0.0, 0.0)


@pytest.mark.parametrize(
    ('odom_pose', 'ranges', 'mount', 'message'),
    [
        (None, np.full(180, np.inf), IDENTITY, 'none of 180 rays'),
        (None, np.full(180, np.nan), IDENTITY, 'none of 180 rays'),
        (None, np.array([]), IDENTITY, '0 ranges; expected at least one'),
        (NAN_POSE, None, IDENTITY, 'odometry pose: given .nan'),
        (Pose2D(0, 0, math.inf), None, IDENTITY, 'odometry pose'),
        (None, None, NAN_POSE, 'laser pose'),
    ],
)
def test_bad_input_leaves_the_filter_as_it_was(drive, odom_pose, ranges, mount, message):
    filter_, untouched = amcl(), amcl()
    run(filter_, drive[:3])
    run(untouched, drive[:3])
    _, good_odom, scan = drive[3]
    bad = scan if ranges is None else scan._replace(ranges_m=ranges)
    particles, latest = filter_.particles, filter_.last_estimate
    with pytest.raises(InputFault, match=message):
        filter_.update(odom_pose or good_odom, bad, mount)
    assert filter_.particles is particles and filter_.last_estimate is latest
    # The next good scan takes up the motion since, and no random number was lost.
    assert (
        filter_.update(good_odom, scan, IDENTITY).base_pose_in_map
        == untouched.update(good_odom, scan, IDENTITY).base_pose_in_map
    )


def test_scans_may_change_length_and_hold_gaps(drive):
    filter_ = amcl(**NO_MOTION_LIMIT)
    rng = np.random.default_rng(0)
    for (true_pose, odom_pose, _), ray_count in zip(drive, (1000, 2, 180, 7, 361, 180, 180, 180)):
        scan = simulated_scan(pillar_room(), true_pose, ray_count=ray_count)
        ranges = scan.ranges_m.copy()
        ranges[rng.random(ray_count) < 0.3] = np.nan
        ranges[0] = 1.0
        estimate = filter_.update(odom_pose, scan._replace(ranges_m=ranges), IDENTITY)
        assert np.isfinite(filter_.particles).all() and np.isfinite(filter_.weights).all()
    assert np.isfinite(estimate.covariance).all()


ROOM = pillar_room()


@pytest.mark.parametrize(
    ('grid', 'message'),
    [
        (ROOM._replace(cells=np.zeros((0, 0), np.int8)), 'given 0 x 0 cells'),
        (ROOM._replace(cells=np.zeros((0, 5), np.int8)), 'given 0 x 5 cells'),
        (ROOM._replace(origin=NAN_POSE), 'map origin: given .nan'),
        (ROOM._replace(resolution_m=0.0), 'resolution of 0.0 m'),
        (ROOM._replace(resolution_m=math.nan), 'resolution of nan m'),
        (ROOM._replace(resolution_m=1e300), 'resolution of 1e.300 m; allowed: 0.001 to 100 m'),
        (ROOM._replace(resolution_m=1e-300), 'resolution of 1e-300 m'),
        (ROOM._replace(cells=np.full((5, 5), UNKNOWN, np.int8)), 'no cell is free'),
        (ROOM._replace(cells=np.full((5, 5), OCCUPIED, np.int8)), 'no cell is free'),
    ],
)
def test_a_bad_map_is_refused_and_the_old_one_stays(grid, message):
    with pytest.raises(InputFault, match=message):
        amcl(grid=grid)
    filter_ = amcl()
    before = filter_.particles
    with pytest.raises(InputFault, match=message):
        filter_.set_map(grid)
    assert filter_.particles is before and filter_.grid.cells.shape == (100, 120)


@pytest.mark.parametrize(
    ('pose', 'covariance', 'message'),
    [
        (NAN_POSE, np.eye(3), 'initial pose: given .nan'),
        (Pose2D(1e300, 0, 0), np.eye(3), 'initial pose'),
        (IDENTITY, np.full((3, 3), np.nan), 'initial covariance'),
        (IDENTITY, -np.eye(3), 'no variance below 0'),
        (IDENTITY, 1e300 * np.eye(3), 'initial covariance'),
        (IDENTITY, np.eye(6), 'shape .6, 6.'),
    ],
)
def test_a_bad_initial_pose_is_refused_and_the_particles_stay(pose, covariance, message):
    filter_ = amcl()
    before = filter_.particles
    with pytest.raises(InputFault, match=message):
        filter_.set_pose(pose, covariance)
    assert filter_.particles is before


def test_an_open_map_moves_the_particles_and_weighs_them_all_alike():
    """Nothing to see, nothing to learn, but no numbers that are none."""
    open_grid = OccupancyGrid(np.zeros((40, 40), np.int8), 0.1, Pose2D(-2, -2, 0))
    filter_ = amcl(grid=open_grid, initial_pose_x=0.0, initial_pose_y=0.0)
    scan = Scan(0, 0.0, 0.1, 0.1, 6.0, np.full(60, 1.0))
    filter_.update(IDENTITY, scan, IDENTITY)
    assert np.ptp(filter_.weights) < 1e-12
