"""Scans wait for their transforms, are used in order, and are dropped with a reason; lasers are mounted any way up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, TransformStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.message_encoders import encode_scan, encode_transform
from diff_encoder_sim.ros import transforms
from diff_encoder_sim.ros.transforms import PATIENCE_NS, mounted

SECOND_NS = 1_000_000_000
LASER = Pose2D(0.2, 0.0, 0.0)
SCAN = Scan(0, -0.5, 0.25, 0.1, 6.0, np.array([1.0, 2.0, 3.0]))


def transform_message(pose, at_s, *frames):
    return TransformStamped().deserialize(encode_transform(pose, round(at_s * SECOND_NS), *frames))


class FedInput:
    """An input with the buffer that it reads, and the scans that it handed on: (stamp [s], x of the base in odom)."""

    def __init__(self):
        self.buffer = tf2_ros.Buffer(rospy.Duration(30.0), debug=False)
        self.used = []
        self.input = transforms.ScanInput(self.buffer, 'base_link', 'odom', self._use, lambda _: None)
        self.buffer.set_transform_static(transform_message(LASER, 0, 'base_link', 'laser'), 'test')

    def _use(self, scan, odom_pose, laser_pose):
        assert laser_pose == pytest.approx(LASER)
        self.used.append((scan.stamp_ns / SECOND_NS, odom_pose.x_m))

    def odometry(self, *times_s):
        for at_s in times_s:
            self.buffer.set_transform(transform_message(Pose2D(at_s, 0.0, 0.0), at_s, 'odom', 'base_link'), 'test')
        self.buffer.on_change()

    def scan(self, at_s, frame='laser'):
        self.input._on_scan(encode_scan(SCAN._replace(stamp_ns=round(at_s * SECOND_NS)), frame, 0.1))


@pytest.fixture
def drive(monkeypatch):
    monkeypatch.setattr(transforms, 'encoded_subscriber', lambda *_: SimpleNamespace(resolved_name='/scan'))
    monkeypatch.setattr(transforms, 'timer', lambda *_: None)
    return FedInput()


def test_a_scan_waits_for_its_odometry_and_has_its_pose(drive):
    drive.odometry(1.0)
    drive.scan(1.5)
    assert drive.used == []
    drive.odometry(2.0)
    assert drive.used == [pytest.approx((1.5, 1.5))]


def test_a_scan_from_an_unknown_frame_does_not_hold_up_others_and_is_dropped(drive, caplog):
    for at_s in (1.0, 1.0 + PATIENCE_NS / SECOND_NS):
        drive.odometry(at_s)
        drive.scan(at_s - 0.01, frame='moon')
        drive.scan(at_s)
    assert [at_s for at_s, _ in drive.used] == [1.0, 3.0]
    assert "'moon'" in caplog.text


def test_a_scan_older_than_all_odometry_is_dropped_at_once(drive, caplog):
    drive.odometry(5.0, 5.1)
    drive.scan(4.0)
    drive.odometry(6.0)
    assert drive.used == [] and len(caplog.records) == 1


def mount(x=0.0, y=0.0, z=0.0, w=0.0):
    transform = TransformStamped()
    transform.transform.translation.x = 0.2
    transform.transform.rotation = Quaternion(x, y, z, w)
    return mounted(SCAN, transform)


def test_a_laser_upside_down_scans_the_other_way_round():
    upright, pose, tilt_rad = mount(z=math.sin(0.3), w=math.cos(0.3))
    assert upright is SCAN and pose == pytest.approx((0.2, 0.0, 0.6)) and tilt_rad == pytest.approx(0.0, abs=1e-7)
    hanging, _, tilt_rad = mount(x=1.0)
    assert hanging.bearings_rad() == pytest.approx(-SCAN.bearings_rad()) and tilt_rad == pytest.approx(0.0, abs=1e-7)
    assert (hanging.ranges_m == SCAN.ranges_m).all()


@pytest.mark.parametrize('tilt_rad', [0.1, 1.0])
def test_a_tilt_is_measured_from_level_either_way_up(tilt_rad):
    assert mount(y=math.sin(tilt_rad / 2), w=math.cos(tilt_rad / 2))[2] == pytest.approx(tilt_rad)
    assert mount(x=math.cos(tilt_rad / 2), z=math.sin(tilt_rad / 2))[2] == pytest.approx(tilt_rad)


def test_a_transform_without_a_rotation_is_refused():
    with pytest.raises(InputFault):
        mount()
