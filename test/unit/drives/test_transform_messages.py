"""Messages of /tf: rosbags reads them, would write the same bytes, and decodes the same."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.pose_messages import (
    SpatialTransform,
    decode_spatial_tf,
    decode_tf,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
)
from message_checks import check_header, quat, read, vector
from reencoding_drives import MAKERS


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


@MAKERS
def test_a_torn_message_is_a_fault_wherever_it_is_torn(maker):
    transforms = maker.raw(maker.tf(maker.transform(5, Pose2D(1.0, 2.0, 0.5), 'map', 'odom')))
    for size in range(4 if maker.is_ros2 else 0, len(transforms)):
        with pytest.raises(InputFault):
            list(decode_tf(transforms[:size], maker.is_ros2))


def test_a_transform_that_is_not_finite_is_a_fault():
    raw = encode_tf(encode_transform(Pose2D(np.nan, 0.0, 0.0), 5, 'map', 'odom'))
    with pytest.raises(InputFault, match='position .* expected finite numbers'):
        list(decode_tf(raw))


def test_spatial_transforms_are_decoded_as_they_were_encoded(rng):
    translation, rotation = tuple(values.floats(rng, 3)), tuple(values.quat_xyzw(rng))
    frames = (('/map', 'ödom'), ('base_link', '/left_wheel'), ('', ''))
    raw = encode_tf(*(encode_spatial_transform(translation, rotation, 5_000_000_007, *pair) for pair in frames))
    assert list(decode_spatial_tf(raw)) == [
        SpatialTransform(5_000_000_007, parent.lstrip('/'), child.lstrip('/'), translation, rotation)
        for parent, child in frames
    ]
    assert list(decode_spatial_tf(encode_tf())) == []
