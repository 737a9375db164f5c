"""Scans wait for their transforms, are used in order, and are dropped with a reason; lasers are mounted any way up."""

import math

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped
from sensor_msgs.msg import LaserScan

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import stamp_from_ns, transform_message
from diff_encoder_sim.ros.transforms import PATIENCE_NS, ScanQueue, scanner_mount

SECOND_NS = 1_000_000_000
LASER = Pose2D(0.2, 0.0, 0.0)
SCAN = Scan(0, -0.5, 0.25, 0.1, 6.0, np.array([1.0, 2.0, 3.0]))


class FedQueue:
    """A queue with the buffer that it reads, and the scans that it handed on: (stamp [s], x of the base in odom)."""

    def __init__(self):
        self.buffer = tf2_ros.Buffer(rospy.Duration(30.0), debug=False)
        self.used = []
        self.queue = ScanQueue('/scan', self.buffer, 'base_link', 'odom', self._use)
        self.buffer.set_transform_static(transform_message(LASER, 0, 'base_link', 'laser'), 'test')

    def _use(self, scan, odom_pose, laser_pose):
        assert laser_pose == pytest.approx(LASER)
        self.used.append((scan.stamp_ns / SECOND_NS, odom_pose.x_m))

    def odometry(self, *times_s):
        for at_s in times_s:
            pose = Pose2D(at_s, 0.0, 0.0)
            self.buffer.set_transform(transform_message(pose, round(at_s * SECOND_NS), 'odom', 'base_link'), 'test')

    def scan(self, at_s, frame='laser'):
        message = LaserScan(ranges=[1.0], range_max=6.0)
        message.header.stamp, message.header.frame_id = stamp_from_ns(round(at_s * SECOND_NS)), frame
        self.queue.add(message)
        self.queue.process()


@pytest.fixture
def drive():
    return FedQueue()


def test_a_scan_waits_for_its_odometry_and_has_its_pose(drive):
    drive.odometry(1.0)
    drive.scan(1.5)
    assert drive.used == []
    drive.odometry(2.0)
    drive.queue.process()
    assert drive.used == [pytest.approx((1.5, 1.5))]


def test_a_scan_from_an_unknown_frame_does_not_hold_up_others_and_is_dropped(drive, caplog):
    for at_s in (1.0, 1.0 + PATIENCE_NS / SECOND_NS):
        drive.odometry(at_s)
        drive.scan(at_s, frame='moon')
        drive.scan(at_s)
    assert [at_s for at_s, _ in drive.used] == [1.0, 3.0]
    assert "'moon'" in caplog.text


def test_a_scan_older_than_all_odometry_is_dropped_at_once(drive, caplog):
    drive.odometry(5.0, 5.1)
    drive.scan(4.0)
    drive.odometry(6.0)
    drive.queue.process()
    assert drive.used == [] and len(caplog.records) == 1


def mount(x=0.0, y=0.0, z=0.0, w=0.0):
    transform = TransformStamped()
    transform.transform.translation.x = 0.2
    transform.transform.rotation = Quaternion(x, y, z, w)
    return scanner_mount(transform)


def test_a_laser_upside_down_scans_the_other_way_round():
    upright, hanging = mount(z=math.sin(0.3), w=math.cos(0.3)), mount(x=1.0)
    assert upright.laser_pose_in_base == pytest.approx((0.2, 0.0, 0.6))
    assert [each.is_upside_down for each in (upright, hanging)] == [False, True]
    assert [each.lean_rad for each in (upright, hanging)] == pytest.approx([0.0, 0.0], abs=1e-7)
    assert upright.level(SCAN) is SCAN
    level = hanging.level(SCAN)
    assert level.bearings_rad() == pytest.approx(-SCAN.bearings_rad())
    assert (level.ranges_m == SCAN.ranges_m).all()


@pytest.mark.parametrize('lean_rad', [0.1, 1.0])
def test_a_tilt_is_measured_from_level_either_way_up(lean_rad):
    assert mount(y=math.sin(lean_rad / 2), w=math.cos(lean_rad / 2)).lean_rad == pytest.approx(lean_rad)
    assert mount(x=math.cos(lean_rad / 2), z=math.sin(lean_rad / 2)).lean_rad == pytest.approx(lean_rad)


def test_a_transform_without_a_rotation_is_refused():
    with pytest.raises(InputFault):
        mount()
