"""Messages to the core's types: what is dropped, and what is refused."""

import math

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from geometry_msgs.msg import Pose, TransformStamped
from nav_msgs.msg import Odometry

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros import conversions

NAN = math.nan
POSE = Pose2D(1.5, -2.0, 2.5)


@pytest.mark.parametrize('stamp_ns', [0, 1, 999_999_999, 1_000_000_000, 1_795_318_047_650_452_001])
def test_stamps_are_whole_nanoseconds_both_ways(stamp_ns):
    assert conversions.ns_from_stamp(conversions.stamp_from_ns(stamp_ns)) == stamp_ns


def test_poses_come_back():
    assert conversions.pose_from_message(conversions.pose_message(POSE)) == pytest.approx(POSE)
    transform = conversions.transform_message(POSE, 5, 'odom', 'base_link')
    assert conversions.pose_from_transform(transform) == pytest.approx(POSE)
    assert (transform.header.frame_id, transform.child_frame_id) == ('odom', 'base_link')


def test_height_roll_and_pitch_are_dropped():
    tilted = TransformStamped()
    tilted.transform.translation.z = 0.4
    # Yaw 90 degrees after a pitch of 10 degrees, of any length.
    half_yaw, half_pitch = math.pi / 4, math.radians(5)
    tilted.transform.rotation.x = -2 * math.sin(half_yaw) * math.sin(half_pitch)
    tilted.transform.rotation.y = 2 * math.cos(half_yaw) * math.sin(half_pitch)
    tilted.transform.rotation.z = 2 * math.sin(half_yaw) * math.cos(half_pitch)
    tilted.transform.rotation.w = 2 * math.cos(half_yaw) * math.cos(half_pitch)
    assert conversions.pose_from_transform(tilted) == pytest.approx((0.0, 0.0, math.pi / 2))


@pytest.mark.parametrize(
    ('x_m', 'w', 'complaint'), [(NAN, 1.0, r'position \(nan'), (0.0, 0.0, 'no rotation'), (0.0, NAN, 'no rotation')]
)
def test_what_is_no_pose_is_refused(x_m, w, complaint):
    pose = Pose()
    pose.position.x, pose.orientation.w = x_m, w
    with pytest.raises(InputFault, match=complaint):
        conversions.pose_from_message(pose)


def test_covariances_are_read_where_messages_have_them():
    message = Odometry()
    message.twist.covariance[0], message.twist.covariance[35] = 4.0, 5.0
    for index, variance in ((0, 1.0), (7, 2.0), (35, 3.0)):
        message.pose.covariance[index] = variance
    assert conversions.twist_std_from_message(message) == pytest.approx((2.0, math.sqrt(5.0)))
    assert conversions.pose_covariance_from_message(message.pose.covariance) == pytest.approx(np.diag([1.0, 2.0, 3.0]))


def test_a_negative_variance_counts_as_0():
    message = Odometry()
    message.twist.covariance[0] = -1.0
    assert conversions.twist_std_from_message(message) == (0.0, 0.0)
