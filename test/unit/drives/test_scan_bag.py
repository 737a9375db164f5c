"""Scans, odometry and the laser's mount out of bags that are made here."""

import math

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.message_types import ODOMETRY
from diff_encoder_sim.drives.scan_bag import ScanBag
from reencoding_drives import ROS1, ROS2, write_ros1, write_ros2

STORE = get_typestore(Stores.ROS1_NOETIC)
STORE.register(get_types_from_msg('geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))
T = {
    name.rsplit('/', 1)[1]: kind
    for name, kind in STORE.types.items()
    if name.startswith(
        (
            'geometry_msgs/',
            'sensor_msgs/msg/LaserScan',
            'nav_msgs/msg/Odometry',
            'std_msgs/msg/Header',
            'tf2_msgs/msg/TFMessage',
            'builtin_interfaces/msg/Time',
        )
    )
}


def header(stamp_ns, frame):
    return T['Header'](0, T['Time'](*divmod(stamp_ns, 10**9)), frame)


def quaternion(yaw_rad):
    return T['Quaternion'](*quat_xyzw_from_yaw(yaw_rad))


def scan(stamp_ns, ranges, frame='laser'):
    return T['LaserScan'](
        header(stamp_ns, frame),
        -1.0,
        1.0,
        0.5,
        0.0,
        0.1,
        0.1,
        6.0,
        np.array(ranges, np.float32),
        np.empty(0, np.float32),
    )


def odometry(stamp_ns, x_m, yaw_rad, quat=None):
    pose = T['Pose'](T['Point'](x_m, 0.0, 0.0), quat or quaternion(yaw_rad))
    zero = T['Vector3'](0.0, 0.0, 0.0)
    return T['Odometry'](
        header(stamp_ns, 'odom'),
        'base_link',
        T['PoseWithCovariance'](pose, np.zeros(36)),
        T['TwistWithCovariance'](T['Twist'](zero, zero), np.zeros(36)),
    )


def transform(parent, child, x_m, yaw_rad):
    return T['TransformStamped'](
        header(0, parent), child, T['Transform'](T['Vector3'](x_m, 0.0, 1.0), quaternion(yaw_rad))
    )


MOUNT = [
    transform('base_link', 'top', 0.2, math.pi / 2),
    transform('top', 'laser', 0.1, 0.0),
    transform('map', 'odom', 5.0, 0.0),
]


def write(path, scans=(), poses=(), mount=(), scan_type='sensor_msgs/msg/LaserScan'):
    with Writer(path) as bag:
        for topic, kind, messages in (
            ('/scan', scan_type, scans),
            ('/odom', 'nav_msgs/msg/Odometry', poses),
            ('/tf_static', 'tf2_msgs/msg/TFMessage', [T['TFMessage'](list(mount))] if mount else []),
        ):
            connection = bag.add_connection(topic, kind, typestore=STORE)
            for number, message in enumerate(messages):
                bag.write(connection, number + 1, STORE.serialize_ros1(message, kind))
    return path


def read(path):
    with open_source(path) as source:
        drive = ScanBag(path, source)
        return drive, list(drive.scans())


def test_scans_odometry_and_mount(tmp_path):
    path = write(tmp_path / 'a.bag', [scan(100, [1.0, math.inf, math.nan])], [odometry(50, 1.0, 0.5)], MOUNT)
    drive, (found,) = read(path)
    assert found.stamp_ns == 100
    assert (found.angle_min_rad, found.angle_increment_rad, found.range_max_m) == (-1.0, 0.5, 6.0)
    assert found.ranges_m == pytest.approx([1.0, math.inf, math.nan], nan_ok=True)
    assert drive.odometry_ns == [50]
    assert drive.base_poses_in_odom[0] == pytest.approx((1.0, 0.0, 0.5))
    # 0.2 m ahead of the base, and 0.1 m further along a y axis.
    assert drive.laser_pose_in_base == pytest.approx((0.2, 0.1, math.pi / 2))


@pytest.mark.parametrize(
    ('parts', 'complaint'),
    [
        (dict(poses=[odometry(0, 0, 0)], mount=MOUNT), 'no message on /scan'),
        (dict(scans=[scan(0, [1.0])], mount=MOUNT), 'no message on /odom'),
        (dict(scans=[scan(0, [1.0])], poses=[odometry(0, 0, 0)]), "'laser' to odometry's 'base_link'"),
        (dict(scans=[scan(0, [1.0], 'camera')], poses=[odometry(0, 0, 0)], mount=MOUNT), "'camera'"),
        (
            dict(
                scans=[scan(0, [1.0])],
                poses=[odometry(0, 0, 0)],
                mount=[transform('laser', 'top', 0, 0), transform('top', 'laser', 0, 0)],
            ),
            'does not lead',
        ),
        (
            dict(scans=[odometry(0, 0, 0)], scan_type='nav_msgs/msg/Odometry', poses=[odometry(0, 0, 0)], mount=MOUNT),
            '/scan is nav_msgs/msg/Odometry; expected sensor_msgs/msg/LaserScan',
        ),
        (
            dict(scans=[scan(0, [1.0])], mount=MOUNT, poses=[odometry(0, 0, 0, T['Quaternion'](0.0, 0.0, 0.0, 0.0))]),
            '/odom: ',
        ),
        (
            dict(scans=[scan(0, [1.0])], mount=MOUNT, poses=[odometry(0, math.nan, 0)]),
            '/odom: position (nan, 0.0, 0.0); expected finite numbers',
        ),
    ],
    ids=['no scan', 'no odometry', 'no mount', 'other frame', 'circle', 'type', 'no rotation', 'no position'],
)
def test_what_is_missing_is_named_in_one_line(tmp_path, parts, complaint):
    path = write(tmp_path / 'a.bag', **parts)
    with pytest.raises(ConfigError) as caught:
        read(path)
    assert str(caught.value).startswith(f'{path}: ') and '\n' not in str(caught.value)
    assert complaint in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'no bag at all'])
def test_files_that_are_no_bags(tmp_path, content):
    path = tmp_path / 'a.bag'
    path.write_bytes(content)
    with pytest.raises(ConfigError, match='not a readable bag'):
        read(path)
    with pytest.raises(ConfigError, match='no such bag'):
        read(tmp_path / 'b.bag')


def test_a_drive_in_a_bag_of_ros_2(tmp_path):
    """In turn with one of ROS 1 that has the same messages."""
    found = []
    for maker, name, writer in ((ROS1, 'a.bag', write_ros1), (ROS2, 'b', write_ros2)):
        rows = [
            ('/tf_static', 1, maker.tf(maker.transform(1, Pose2D(0.2, 0.1, 0.5), 'base_link', 'laser'))),
            ('/odom', 2, maker.pose(ODOMETRY, 2, Pose2D(1.0, 2.0, 0.25))),
            ('/scan', 3, maker.scan(3, [1.0, 2.0, 3.0], 'laser')),
        ]
        drive, (scan,) = read(writer(tmp_path / name, rows))
        found.append((drive.odometry_ns, drive.base_poses_in_odom, drive.laser_pose_in_base, scan.stamp_ns))
        assert scan.ranges_m.tolist() == [1.0, 2.0, 3.0]
    assert found[0] == found[1] and found[0][0] == [2]
