"""Scans wait for their transforms, are used in order, and are dropped with a reason when none comes."""

import logging

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import stamp_from_ns, transform_message
from diff_encoder_sim.ros.transforms import PATIENCE_NS, ScanQueue

SECOND_NS = 1_000_000_000
LASER = Pose2D(0.2, 0.0, 0.0)


class FedQueue:
    """A queue with the buffer that it reads, and the scans that it handed on: (stamp [s], x of the base in odom)."""

    def __init__(self):
        self.buffer = tf2_ros.Buffer(rospy.Duration(30.0), debug=False)
        self.used = []
        self.queue = ScanQueue('/scan', self.buffer, 'base_link', 'odom', self._take)

    def _take(self, scan, odom_pose, laser_pose):
        assert laser_pose == pytest.approx(LASER)
        self.used.append((scan.stamp_ns / SECOND_NS, odom_pose.x_m))

    def mount(self, frame='laser'):
        self.buffer.set_transform_static(transform_message(LASER, 0, 'base_link', frame), 'test')

    def odometry(self, at_s):
        pose = Pose2D(at_s, 0.0, 0.0)
        self.buffer.set_transform(transform_message(pose, round(at_s * SECOND_NS), 'odom', 'base_link'), 'test')

    def scan(self, at_s, frame='laser'):
        message = LaserScan(ranges=[1.0], range_max=6.0)
        message.header.stamp, message.header.frame_id = stamp_from_ns(round(at_s * SECOND_NS)), frame
        self.queue.add(message)
        self.queue.process()


@pytest.fixture(name='drive')
def fixture_drive(caplog):
    caplog.set_level(logging.INFO, logger='diff_encoder_sim')
    return FedQueue()


def test_a_scan_waits_for_its_odometry_and_has_its_pose(drive):
    drive.mount()
    drive.odometry(1.0)
    drive.scan(1.5)
    assert drive.used == []
    drive.odometry(2.0)
    drive.queue.process()
    assert drive.used == [pytest.approx((1.5, 1.5))]


def test_a_scan_from_an_unknown_frame_does_not_hold_up_others_and_is_dropped(drive, caplog):
    drive.mount()
    for at_s in (1.0, 1.0 + PATIENCE_NS / SECOND_NS):
        drive.odometry(at_s)
        drive.scan(at_s, frame='moon')
        drive.scan(at_s)
    assert [at_s for at_s, _ in drive.used] == [1.0, 3.0]
    assert "scan dropped: no transform from 'moon' to 'base_link'" in caplog.text


def test_a_scan_older_than_all_odometry_is_dropped_at_once(drive, caplog):
    drive.mount()
    drive.odometry(5.0)
    drive.odometry(5.1)
    drive.scan(4.0)
    assert drive.used == [] and 'at its stamp (the buffer begins later)' in caplog.text


def test_waiting_scans_can_be_forgotten(drive):
    drive.mount()
    drive.scan(1.0)
    drive.queue.clear()
    drive.odometry(1.0)
    drive.queue.process()
    assert drive.used == []


def test_a_gap_between_used_scans_is_reported(drive, caplog):
    drive.mount()
    for at_s in (1.0, 4.0):
        drive.odometry(at_s)
        drive.scan(at_s)
    assert 'scans are used again, after 3.0 s without one' in caplog.text
