"""Scans, odometry and the laser's mount out of bags that are made here."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.scan_bag import read_scan_drive, read_scans
from diff_encoder_sim.drives.topics import ODOMETRY_TYPE as ODOMETRY
from reencoding_drives import MAKERS, ROS1, write


def parts(maker):
    """Rows of a drive by name."""
    mount = (('base_link', 'top', 0.2, math.pi / 2), ('top', 'laser', 0.1, 0.0), ('map', 'odom', 5.0, 0.0))
    frames = [maker.transform(1, Pose2D(x_m, 0.0, yaw_rad), *names) for *names, x_m, yaw_rad in mount]
    return {
        'mount': ('/tf_static', 1, maker.tf(*frames)),
        'odometry': ('/odom', 50, maker.pose(ODOMETRY, 50, Pose2D(1.0, 2.0, 0.5))),
        'scan': ('/scan', 100, maker.scan(100, [1.0, math.inf, math.nan], 'laser')),
    }


def read(path):
    source = open_source(path)
    return read_scan_drive(source), list(read_scans(source))


@MAKERS
def test_scans_odometry_and_mount(tmp_path, maker):
    ((stamps_ns, poses), laser_pose_in_base), (found,) = read(write(tmp_path / 'a', list(parts(maker).values())))
    assert (found.stamp_ns, stamps_ns.tolist()) == (100, [50])
    message = parts(maker)['scan'][2]
    assert found[1:5] == (message.angle_min, message.angle_increment, message.range_min, message.range_max)
    assert found.ranges_m == pytest.approx([1.0, math.inf, math.nan], nan_ok=True)
    assert poses[0] == pytest.approx((1.0, 2.0, 0.5))
    # 0.2 m ahead of the base, and 0.1 m further along a y axis.
    assert laser_pose_in_base == pytest.approx((0.2, 0.1, math.pi / 2))


@pytest.mark.parametrize(
    ('name', 'row', 'complaint'),
    [
        ('scan', None, '/scan'),
        ('odometry', None, '/odom'),
        ('mount', None, "'laser' to the base frame 'base_link'"),
        ('scan', ('/scan', 9, ROS1.scan(9, [1.0], 'camera')), "'camera'"),
        ('scan', ('/scan', 9, ROS1.pose(ODOMETRY, 9, Pose2D(0.0, 0.0, 0.0))), f'/scan is {ODOMETRY}; expected sensor'),
        ('odometry', ('/odom', 9, ROS1.pose(ODOMETRY, 9, Pose2D(math.nan, 0.0, 0.0))), 'expected finite numbers'),
    ],
)
def test_what_is_missing_is_named_in_one_line(tmp_path, name, row, complaint):
    rows = {**parts(ROS1), name: row}
    path = write(tmp_path / 'a.bag', [row for row in rows.values() if row])
    with pytest.raises(ConfigError) as caught:
        read(path)
    assert str(caught.value).startswith(f'{path}: ') and '\n' not in str(caught.value)
    assert complaint in str(caught.value)
