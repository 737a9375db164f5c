"""Stamped poses: rosbags reads them, would write the same bytes, and decodes the same."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.pose_messages import (
    POSE_TYPES,
    PoseDecoder,
    encode_odometry,
    encode_pose_stamped,
    encode_pose_with_covariance,
)
from diff_encoder_sim.drives.wire import UNKNOWN_VARIANCE
from message_checks import check_header, check_pose, read, vector
from reencoding_drives import MAKERS

# x [m], y [m], yaw [rad] within what a decoder takes for a pose.
POSES = [Pose2D(*row) for row in np.random.default_rng(2).uniform(-3.0, 3.0, (20, 3)).tolist()]


def test_odometry(rng):
    estimate = values.estimate(rng)._replace(lateral_velocity_mps=0.125)
    message = read(encode_odometry(estimate, 'odom', 'base_link'), 'nav_msgs/msg/Odometry')
    check_header(message.header, estimate.stamp_ns, 'odom')
    assert message.child_frame_id == 'base_link'
    check_pose(message.pose.pose, estimate.base_pose_in_odom)
    assert vector(message.twist.twist.linear) == (estimate.linear_velocity_mps, 0.125, 0.0)
    assert vector(message.twist.twist.angular) == (0.0, 0.0, estimate.angular_velocity_radps)
    for part, planar, axes in (
        (message.pose, estimate.pose_covariance, [0, 1, 5]),
        (message.twist, estimate.twist_covariance, [0, 5]),
    ):
        expected = np.diag([UNKNOWN_VARIANCE] * 6)
        expected[np.ix_(axes, axes)] = planar
        assert np.array_equal(part.covariance.reshape(6, 6), expected)


def test_pose_stamped(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encode_pose_stamped(pose, now_ns, 'map'), 'geometry_msgs/msg/PoseStamped')
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose, pose)


def test_pose_with_covariance(rng):
    pose, covariance, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    message = read(
        encode_pose_with_covariance(pose, covariance, now_ns, 'map'), 'geometry_msgs/msg/PoseWithCovarianceStamped'
    )
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose.pose, pose)
    expected = np.zeros((6, 6))
    expected[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    assert np.array_equal(message.pose.covariance.reshape(6, 6), expected)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_poses_that_rosbags_encodes(maker, kind):
    rng, decoder = np.random.default_rng(2), PoseDecoder(kind, maker.is_ros2)
    for pose in POSES:
        now_ns = int(rng.integers(0, 2**31 * 10**9))
        found = decoder.decode(maker.raw(maker.pose(kind, now_ns, pose)))
        assert (found.stamp_ns, found.parent_frame) == (now_ns, 'map')
        assert found.pose == pytest.approx(pose, abs=1e-15)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_a_torn_message_is_a_fault_and_leaves_the_next_ones_as_they_are(maker, kind):
    raw = maker.raw(maker.pose(kind, 7, Pose2D(1.0, 2.0, 0.5)))
    learned, fresh = PoseDecoder(kind, maker.is_ros2), PoseDecoder(kind, maker.is_ros2)
    expected = learned.decode(raw)
    pose_end = raw.index(np.array([1.0, 2.0, 0.0]).tobytes()) + 56
    for size in range(pose_end):
        for decoder in (learned, fresh):
            with pytest.raises(InputFault):
                decoder.decode(raw[:size])
        assert learned.decode(raw) == expected
    assert fresh.decode(raw) == expected


@MAKERS
@pytest.mark.parametrize(
    'pose', [Pose2D(np.nan, 0.0, 0.0), Pose2D(0.0, np.inf, 0.0), Pose2D(0.0, 0.0, np.nan), Pose2D(1e200, 0.0, 0.0)]
)
def test_a_pose_that_is_not_finite_is_a_fault(maker, pose):
    kind = 'geometry_msgs/msg/PoseStamped'
    with pytest.raises(InputFault, match=r'position .* expected finite numbers|is no rotation'):
        PoseDecoder(kind, maker.is_ros2).decode(maker.raw(maker.pose(kind, 7, pose)))
