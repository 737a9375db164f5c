"""Parts of ROS messages as they are on the wire: little endian, sequences after their length."""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Sequence, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

_LENGTH = struct.Struct('<I')
_TIME, _SEQ_AND_STAMP = struct.Struct('<2I'), struct.Struct('<3I')
_POSE, _TWIST = struct.Struct('<7d'), struct.Struct('<6d')

Vector = Tuple[float, float, float]
QuatXyzw = Tuple[float, float, float, float]


def packed_time(stamp_ns: int) -> bytes:
    """Time."""
    return _TIME.pack(*divmod(stamp_ns, NANOSECONDS_PER_SECOND))


def packed_header(stamp_ns: int, frame: str) -> bytes:
    """std_msgs/Header with seq 0."""
    return _SEQ_AND_STAMP.pack(0, *divmod(stamp_ns, NANOSECONDS_PER_SECOND)) + packed_text(frame)


def packed_pose(position_xyz_m: Vector, quat_xyzw: QuatXyzw) -> bytes:
    """geometry_msgs/Pose, or Transform."""
    return _POSE.pack(*position_xyz_m, *quat_xyzw)


def packed_twist(linear_xyz_mps: Vector, angular_xyz_radps: Vector) -> bytes:
    """geometry_msgs/Twist."""
    return _TWIST.pack(*linear_xyz_mps, *angular_xyz_radps)


def packed_sequence(elements: Sequence[bytes]) -> bytes:
    """Of elements that are packed already."""
    return _LENGTH.pack(len(elements)) + b''.join(elements)


def packed_numbers(kind: str, numbers: Sequence[float]) -> bytes:
    """float64[] of kind 'd', int64[] of 'q'."""
    return struct.pack(f'<I{len(numbers)}{kind}', len(numbers), *numbers)


# Frames and joints are few, and in every message.
@lru_cache(maxsize=64)
def packed_text(text: str) -> bytes:
    """String."""
    content = text.encode('utf-8')
    return _LENGTH.pack(len(content)) + content


@lru_cache(maxsize=16)
def packed_texts(texts: Tuple[str, ...]) -> bytes:
    """string[]."""
    return packed_sequence([packed_text(text) for text in texts])
