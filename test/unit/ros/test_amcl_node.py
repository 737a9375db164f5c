"""A pose that a user gives is moved by odometry from its stamp to now; bad ones are in test/rostest/amcl_test.py."""

import math

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.message_encoders import encode_pose_with_covariance, encode_transform
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.amcl_node import read_initial_pose

SECOND_NS = 1_000_000_000
COVARIANCE = np.diag([0.25, 0.25, 0.07])
GIVEN = Pose2D(2.0, 1.0, math.pi / 2)


@pytest.fixture(name='read')
def fixture_read():
    """The robot has driven 1 m ahead from 10 s to 11 s of odometry."""
    buffer = tf2_ros.Buffer(rospy.Duration(30.0), debug=False)
    for at_s in (10, 11):
        pose = Pose2D(at_s - 10.0, 0.0, 0.0)
        content = encode_transform(pose, at_s * SECOND_NS, 'odom', 'base_link')
        buffer.set_transform(TransformStamped().deserialize(content), 'test')

    def read(at_s, frame):
        content = encode_pose_with_covariance(GIVEN, COVARIANCE, round(at_s * SECOND_NS), frame)
        return read_initial_pose(PoseWithCovarianceStamped().deserialize(content), AmclParams(), buffer)

    return read


@pytest.mark.parametrize(
    ('at_s', 'frame', 'expected', 'warnings'),
    [
        (0, 'map', GIVEN, 0),  # now
        (10, 'map', Pose2D(2.0, 2.0, math.pi / 2), 0),
        (10.5, '/map', Pose2D(2.0, 1.5, math.pi / 2), 0),
        (11, 'map', GIVEN, 0),
        (99, 'map', GIVEN, 0),
        (5, 'map', GIVEN, 1),  # before all odometry
        (0, '', GIVEN, 1),
    ],
)
def test_a_pose_of_some_time_ago_is_moved_by_odometry(read, at_s, frame, expected, warnings, caplog):
    pose, covariance = read(at_s, frame)
    assert pose == pytest.approx(expected) and covariance == pytest.approx(COVARIANCE)
    assert len(caplog.records) == warnings
