"""Poses that a user gives to amcl_node, and faults in move_base_node; the rest is in test/rostest."""

import io
import math
from types import SimpleNamespace

import numpy as np
import pytest
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.message_encoders import encode_pose_with_covariance, encode_transform
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator_inputs import STOP, ControlRate
from diff_encoder_sim.ros.amcl_node import read_initial_pose
from diff_encoder_sim.ros.move_base_node import MoveBaseNode

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


def test_a_fault_in_the_control_period_stops_the_robot():
    """rospy logs an exception and goes on: the base would keep the last command."""
    node, commands, samples = object.__new__(MoveBaseNode), [], []
    node._navigator, node._transforms = (
        SimpleNamespace(take_odometry=samples.append),
        SimpleNamespace(odom_frame='odom'),
    )
    node._control_rate, node._command = ControlRate(20.0), commands.append

    def fail(*_):
        raise OverflowError

    node._control = fail
    message, content = Odometry(), io.BytesIO()
    message.pose.pose.orientation.w = 1.0
    message.twist.covariance[0], message.twist.covariance[35] = 4.0, -5.0  # negative: unknown
    message.serialize(content)
    with pytest.raises(OverflowError):
        node._on_odometry(content.getvalue())
    assert commands == [STOP]
    assert (samples[0].linear_std_mps, samples[0].angular_std_radps) == (2.0, 0.0)
