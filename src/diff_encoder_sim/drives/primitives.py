"""The parts that serialized ROS messages are made of: little endian, each sequence after its length.

The formats are common to ROS 1 and ROS 2; the functions encode ROS 1.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

UINT16, UINT32, UINT64 = struct.Struct('<H'), struct.Struct('<I'), struct.Struct('<Q')
LENGTH = UINT32  # of a text or a sequence
NUMBER_SIZE = 8  # of float64 and int64, which CDR aligns to it
TIME = struct.Struct('<2I')  # seconds, nanoseconds
POSE = struct.Struct('<7d')  # position or translation x, y, z; quaternion x, y, z, w
TWIST = struct.Struct('<6d')  # linear x, y, z; angular x, y, z

_SEQ_AND_STAMP = struct.Struct('<3I')

Vector = Tuple[float, float, float]
QuatXyzw = Tuple[float, float, float, float]


def encode_time(stamp_ns: int) -> bytes:
    """Encode a time."""
    return TIME.pack(*divmod(stamp_ns, NANOSECONDS_PER_SECOND))


def encode_header(stamp_ns: int, frame: str) -> bytes:
    """Encode std_msgs/Header with seq 0."""
    return _SEQ_AND_STAMP.pack(0, *divmod(stamp_ns, NANOSECONDS_PER_SECOND)) + encode_name(frame)


def with_seq(message: bytes, seq: int) -> bytes:
    """Set the seq of a message that begins with a header."""
    return UINT32.pack(seq) + message[UINT32.size :]


def encode_pose(position_xyz_m: Vector, quat_xyzw: QuatXyzw) -> bytes:
    """Encode geometry_msgs/Pose or Transform."""
    return POSE.pack(*position_xyz_m, *quat_xyzw)


def encode_twist(linear_xyz_mps: Vector, angular_xyz_radps: Vector) -> bytes:
    """Encode geometry_msgs/Twist."""
    return TWIST.pack(*linear_xyz_mps, *angular_xyz_radps)


def encode_text(text: str) -> bytes:
    """Encode a string."""
    content = text.encode('utf-8')
    return LENGTH.pack(len(content)) + content


# Frames and joints are few, and in every message.
encode_name = lru_cache(maxsize=64)(encode_text)


@lru_cache(maxsize=16)
def encode_names(names: Tuple[str, ...]) -> bytes:
    """Encode string[]."""
    return encode_sequence([encode_text(name) for name in names])


def encode_sequence(elements: Sequence[bytes]) -> bytes:
    """Encode a sequence of encoded elements."""
    return LENGTH.pack(len(elements)) + b''.join(elements)


def encode_numbers(kind: str, numbers: Sequence[float]) -> bytes:
    """Encode a few numbers: float64[] of kind 'd', int64[] of 'q'."""
    return struct.pack(f'<I{len(numbers)}{kind}', len(numbers), *numbers)


def encode_array(numbers: np.ndarray, dtype: str) -> bytes:
    """Encode many numbers, row by row: float32[] of dtype '<f4', int8[] of 'i1'."""
    return LENGTH.pack(numbers.size) + numbers.astype(dtype).tobytes()
