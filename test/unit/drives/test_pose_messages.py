"""Messages of poses, transforms and models: rosbags reads them, and decodes the same."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.drives.pose_messages import (
    POSE_TYPES,
    ModelStateDecoder,
    ModelStatesEncoder,
    PoseDecoder,
    decode_tf,
    encode_odometry,
    encode_pose_stamped,
    encode_pose_with_covariance,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
)
from diff_encoder_sim.drives.wire import (
    UNKNOWN_VARIANCE,
    FieldReader,
    encode_amcl_covariance,
    encode_odometry_covariance,
    encode_twist_covariance,
)
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import TwistCovariance
from message_checks import check_header, check_pose, quat, read, vector
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


def test_transforms(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    translation, rotation = values.floats(rng, 3), values.quat_xyzw(rng)
    raw = encode_tf(
        encode_transform(pose, now_ns, 'map', 'odom'),
        encode_spatial_transform(translation, rotation, now_ns + 1, 'base_link', 'left_wheel'),
    )
    planar, spatial = read(raw, 'tf2_msgs/msg/TFMessage').transforms
    check_header(planar.header, now_ns, 'map')
    assert (planar.child_frame_id, spatial.child_frame_id) == ('odom', 'left_wheel')
    assert vector(planar.transform.translation) == (pose.x_m, pose.y_m, 0.0)
    assert quat(planar.transform.rotation) == (0.0, 0.0, math.sin(0.5 * pose.yaw_rad), math.cos(0.5 * pose.yaw_rad))
    check_header(spatial.header, now_ns + 1, 'base_link')
    assert (vector(spatial.transform.translation), quat(spatial.transform.rotation)) == (translation, rotation)


@MAKERS
def test_transforms_that_rosbags_encodes(maker):
    sent = [
        maker.transform(5, Pose2D(1.0, 2.0, 0.5), '/map', 'odom'),
        maker.transform(6, Pose2D(-1.0, 0.0, -3.0), 'odom', 'base_link'),
    ]
    found = list(decode_tf(maker.raw(maker.tf(*sent)), maker.is_ros2))
    assert [(pose.stamp_ns, pose.parent_frame, pose.child_frame) for pose in found] == [
        (5, 'map', 'odom'),
        (6, 'odom', 'base_link'),
    ]
    assert found[1].pose == pytest.approx((-1.0, 0.0, -3.0))


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(values.body(rng))  # what was said before leaves no trace
    message = read(models.encode(body), 'gazebo_msgs/msg/ModelStates')
    assert message.name == ['floor', 'walls', 'pillars', 'alto']
    for model, pose, twist in zip(world.models, message.pose, message.twist):
        assert vector(pose.position) == tuple(model.pose_in_world[:3, 3])
        yaw_rad = yaw_from_quat_xyzw(*quat(pose.orientation))
        assert (np.cos(yaw_rad), np.sin(yaw_rad)) == pytest.approx(tuple(model.pose_in_world[:2, 0]))
        assert vector(twist.linear) == vector(twist.angular) == (0.0, 0.0, 0.0)
    pose, twist = message.pose[-1], message.twist[-1]
    assert (vector(pose.position), quat(pose.orientation), vector(twist.linear), vector(twist.angular)) == body


def test_one_models_state_is_decoded_as_it_was_encoded(rng):
    world, body = values.world(rng), values.body(rng)
    raw, decoder = ModelStatesEncoder(world, 'alto').encode(body), ModelStateDecoder('alto')
    assert decoder.decode(raw) == decoder.decode(raw) == body
    assert ModelStateDecoder('walls').decode(raw).position_xyz_m == tuple(world.models[1].pose_in_world[:3, 3])
    other = ModelStatesEncoder(world, 'robot').encode(body)
    with pytest.raises(InputFault, match="no model 'alto'; expected it among"):
        decoder.decode(other)
    assert decoder.decode(raw) == body


PLANAR = PlanarCovariance(*range(1, 7))


TWIST = TwistCovariance(1.0, 2.0, 3.0)


def matrix(raw):
    return np.frombuffer(raw, '<f8').reshape(6, 6)


def test_what_wheels_do_not_measure_is_unknown_and_of_amcl_zero():
    assert np.diag(matrix(encode_odometry_covariance(PLANAR))).tolist() == [1.0, 4.0, 1e12, 1e12, 1e12, 6.0]
    assert np.diag(matrix(encode_twist_covariance(TWIST))).tolist() == [1.0, 1e12, 1e12, 1e12, 1e12, 3.0]
    assert np.diag(matrix(encode_amcl_covariance(PLANAR.matrix()))).tolist() == [1.0, 4.0, 0.0, 0.0, 0.0, 6.0]


@pytest.mark.parametrize('raw', [b'', b'\0', b'\0\0\0\0', b'\1\0\0\0'])
def test_a_foreign_byte_order_is_a_fault(raw):
    with pytest.raises(InputFault, match='not little-endian CDR'):
        FieldReader(raw, is_cdr=True)
