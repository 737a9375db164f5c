"""Mapping a recorded drive."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.grid_slam import GridSlam, OdometryTrack, map_recording
from slam_room import around_the_room, params, room_scan

SECOND_NS = 10**9


def recording():
    scans = [room_scan(pose, stamp_ns=(10 * index + 5) * 10**8) for index, pose in enumerate(around_the_room())]
    stamps_ns = [index * SECOND_NS for index in range(len(scans) + 1)]
    return stamps_ns, [*around_the_room(), around_the_room()[-1]], scans


def test_a_recording_is_mapped(caplog):
    stamps_ns, poses, scans = recording()
    slam = GridSlam(params(throttle_scans=2), np.random.default_rng(0))
    entered = map_recording(slam, OdometryTrack(stamps_ns, poses), scans, IDENTITY)
    assert entered == len(slam.trajectory) == 20 and not caplog.records
    halfway = slam.trajectory[0].base_pose_in_map
    assert halfway == pytest.approx(np.mean([poses[0], poses[1]], axis=0), abs=1e-9)


def test_a_recording_that_goes_back_in_time_keeps_the_first_drive(caplog):
    stamps_ns, poses, scans = recording()
    slam = GridSlam(params(angularUpdate=0.1), np.random.default_rng(0))
    track = OdometryTrack(stamps_ns + stamps_ns[:5], poses + poses[:5])
    map_recording(slam, track, scans + scans[:5], IDENTITY)
    assert len(slam.trajectory) == len(scans)
    assert 'odometry stamps go back' in caplog.text and 'the map so far is kept' in caplog.text


@pytest.mark.parametrize(
    ('has_odometry', 'has_scans', 'message'),
    [(False, True, 'no odometry for the scans'), (True, False, 'no scans for the odometry')],
)
def test_half_a_recording_is_refused(has_odometry, has_scans, message):
    stamps_ns, poses, scans = recording()
    track = OdometryTrack(stamps_ns, poses) if has_odometry else OdometryTrack([], [])
    with pytest.raises(ConfigError, match=message):
        map_recording(GridSlam(params(), np.random.default_rng(0)), track, scans if has_scans else [], IDENTITY)


def test_odometry_of_another_time_is_refused(caplog):
    stamps_ns, poses, scans = recording()
    later = OdometryTrack([stamp_ns + 1000 * SECOND_NS for stamp_ns in stamps_ns], poses)
    with pytest.raises(ConfigError, match='none of 40 scans'):
        map_recording(GridSlam(params(), np.random.default_rng(0)), later, scans, IDENTITY)
    assert 'no odometry at its stamp' in caplog.text
