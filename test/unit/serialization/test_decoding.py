"""What is decoded by hand is what rosbags decodes."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.serialization import decoding
from diff_encoder_sim.serialization.message_types import ENCODER_PULSE, JOINT_STATE
from reencoding_drives import ROS1, ROS2

MAKERS = pytest.mark.parametrize('maker', [ROS1, ROS2], ids=['ROS 1', 'ROS 2'])
NAMES = (('left', 'right'), ('a', 'bb', 'ccc', 'dddd', 'räder'), (), ('x',))


@MAKERS
def test_joint_states(maker):
    rng, decoder = np.random.default_rng(1), decoding.JointDecoder(JOINT_STATE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        decoded = decoder.decode(maker.raw(message))
        assert decoded.stamp_ns == stamp_ns and decoded.names == names
        assert list(decoded.values) == message.position.tolist()


@MAKERS
def test_encoder_pulses(maker):
    decoder = decoding.JointDecoder(ENCODER_PULSE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [0, -1], [5]):
        assert list(decoder.decode(maker.raw(maker.pulses(7, counts))).values) == counts


@MAKERS
@pytest.mark.parametrize('kind', decoding.POSE_TYPES)
def test_poses(maker, kind):
    rng = np.random.default_rng(2)
    for _ in range(20):
        pose, stamp_ns = Pose2D(*rng.uniform(-3.0, 3.0, 3).tolist()), int(rng.integers(0, 2**31 * 10**9))
        found = decoding.decode_pose(kind, maker.raw(maker.pose(kind, stamp_ns, pose)), maker.is_ros2)
        assert (found.stamp_ns, found.parent_frame) == (stamp_ns, 'map')
        assert found.pose == pytest.approx(pose, abs=1e-15)


@MAKERS
def test_transforms(maker):
    sent = [
        maker.transform(5, Pose2D(1.0, 2.0, 0.5), '/map', 'odom'),
        maker.transform(6, Pose2D(-1.0, 0.0, -3.0), 'odom', 'base_link'),
    ]
    found = list(decoding.decode_transforms(maker.raw(maker.tf(*sent)), maker.is_ros2))
    assert [(pose.stamp_ns, pose.parent_frame, pose.child_frame) for pose in found] == [
        (5, 'map', 'odom'),
        (6, 'odom', 'base_link'),
    ]
    assert found[1].pose == pytest.approx((-1.0, 0.0, -3.0))


@MAKERS
def test_a_torn_message_is_a_fault_wherever_it_is_torn(maker):
    kind = 'nav_msgs/msg/Odometry'
    joints = maker.raw(maker.joint_state(7, (1.0, 2.0)))
    pose = maker.raw(maker.pose(kind, 7, Pose2D(1.0, 2.0, 0.5)))
    transforms = maker.raw(maker.tf(maker.transform(5, Pose2D(1.0, 2.0, 0.5), 'map', 'odom')))
    decoder = decoding.JointDecoder(JOINT_STATE, maker.is_ros2)
    values_end = joints.index(np.array([1.0, 2.0]).tobytes()) + 16
    pose_end = pose.index(np.array([1.0, 2.0, 0.0]).tobytes()) + 56
    for size in range(values_end):
        with pytest.raises(InputFault):
            decoder.decode(joints[:size])
        with pytest.raises(InputFault):
            decoding.JointDecoder(JOINT_STATE, maker.is_ros2).decode(joints[:size])
    for size in range(pose_end):
        with pytest.raises(InputFault):
            decoding.decode_pose(kind, pose[:size], maker.is_ros2)
    for size in range(4 if maker.is_ros2 else 0, len(transforms)):
        with pytest.raises(InputFault):
            list(decoding.decode_transforms(transforms[:size], maker.is_ros2))


@MAKERS
def test_a_torn_message_leaves_the_next_ones_as_they_are(maker):
    decoder = decoding.JointDecoder(JOINT_STATE, maker.is_ros2)
    raw = maker.raw(maker.joint_state(7, (1.0, 2.0)))
    expected = decoder.decode(raw)
    other = maker.raw(maker.joint_state(7, (1.0, 2.0, 3.0), ('a', 'b', 'c')))
    for size in range(other.index(np.array([1.0]).tobytes())):
        with pytest.raises(InputFault):
            decoder.decode(other[:size])
        assert decoder.decode(raw) == expected


@MAKERS
@pytest.mark.parametrize(
    'pose', [Pose2D(np.nan, 0.0, 0.0), Pose2D(0.0, np.inf, 0.0), Pose2D(0.0, 0.0, np.nan), Pose2D(1e200, 0.0, 0.0)]
)
def test_a_pose_that_is_not_finite_is_a_fault(maker, pose):
    kind = 'geometry_msgs/msg/PoseStamped'
    with pytest.raises(InputFault, match='no position|no rotation'):
        decoding.decode_pose(kind, maker.raw(maker.pose(kind, 7, pose)), maker.is_ros2)
