"""Messages of /tf and /tf_static."""

from __future__ import annotations

from typing import Iterator

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.serialization.field_reader import FieldReader
from diff_encoder_sim.serialization.pose_messages import StampedPose, encode_planar_pose, read_stamped_pose
from diff_encoder_sim.serialization.primitives import (
    QuatXyzw,
    Vector,
    encode_header,
    encode_name,
    encode_pose,
    encode_sequence,
)


def encode_transform(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's planar pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_planar_pose(child_pose)


def encode_spatial_transform(
    translation_xyz_m: Vector, quat_xyzw: QuatXyzw, stamp_ns: int, parent_frame: str, child_frame: str
) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_pose(translation_xyz_m, quat_xyzw)


def encode_tf(*transforms: bytes) -> bytes:
    """Encode tf2_msgs/TFMessage of encoded transforms."""
    return encode_sequence(transforms)


def decode_tf(raw: bytes, is_cdr: bool = False) -> Iterator[StampedPose]:
    """Decode the poses of a TFMessage, seen from above.

    Raises:
        InputFault: the message is torn, or a pose is not finite.
    """
    fields = FieldReader(raw, is_cdr)
    for _ in range(fields.length()):
        yield read_stamped_pose(fields)
