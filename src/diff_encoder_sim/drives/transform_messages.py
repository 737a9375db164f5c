"""Messages of /tf and /tf_static."""

from __future__ import annotations

import struct
from typing import Iterator, NamedTuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.field_reader import FRAME_AT, STAMP_AT, TORN, FieldReader
from diff_encoder_sim.drives.pose_messages import StampedPose, encode_planar_pose, read_stamped_pose
from diff_encoder_sim.drives.primitives import (
    LENGTH,
    POSE,
    TIME,
    QuatXyzw,
    Vector,
    encode_header,
    encode_name,
    encode_pose,
    encode_sequence,
)


class SpatialTransform(NamedTuple):
    """A child frame's pose in its parent frame at one instant; names without a leading slash."""

    stamp_ns: int
    parent: str
    child: str
    translation_xyz_m: Vector
    quat_xyzw: QuatXyzw


def encode_transform(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's planar pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_planar_pose(child_pose)


def encode_spatial_transform(
    translation_xyz_m: Vector, quat_xyzw: QuatXyzw, stamp_ns: int, parent_frame: str, child_frame: str
) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_pose(translation_xyz_m, quat_xyzw)


def encode_planar_tf(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode tf2_msgs/TFMessage of one frame's planar pose in its parent."""
    return encode_tf(encode_transform(child_pose, stamp_ns, parent_frame, child_frame))


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


def decode_spatial_tf(raw: bytes) -> Iterator[SpatialTransform]:
    """Decode the transforms of a TFMessage of ROS 1.

    Raises:
        InputFault: the message is torn.
    """
    at = LENGTH.size
    try:
        for _ in range(LENGTH.unpack_from(raw)[0]):
            seconds, nanoseconds = TIME.unpack_from(raw, at + STAMP_AT)
            parent_at = at + FRAME_AT + LENGTH.size
            parent_end = parent_at + LENGTH.unpack_from(raw, parent_at - LENGTH.size)[0]
            child_at = parent_end + LENGTH.size
            at = child_at + LENGTH.unpack_from(raw, parent_end)[0]
            numbers = POSE.unpack_from(raw, at)
            stamp_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
            yield SpatialTransform(
                stamp_ns, _name(raw[parent_at:parent_end]), _name(raw[child_at:at]), numbers[:3], numbers[3:]
            )
            at += POSE.size
    except struct.error:
        raise InputFault(TORN) from None


def _name(raw: bytes) -> str:
    return raw.decode('utf-8', 'replace').lstrip('/')
