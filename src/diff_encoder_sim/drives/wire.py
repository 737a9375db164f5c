"""Serialized ROS messages: primitives, field by field, and the names of types."""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import Any, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import LATEST_NS, NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import TwistCovariance

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


# The variance of height, roll and pitch, which wheels do not measure; the value is that of gazebo_ros_diff_drive.
UNKNOWN_VARIANCE = 1e12


TORN = 'a message is torn'

# A header begins with its stamp and its frame, after four bytes: ROS 1's seq or CDR's representation.
STAMP_AT, FRAME_AT = 4, 12

_CDR_BEGIN = 4
_LITTLE_ENDIAN_CDR = b'\1'


def encoded_stamp_ns(content: bytes) -> int:
    """Return the stamp of a message that begins with a header.

    Raises:
        InputFault: the message is torn.
    """
    if len(content) < STAMP_AT + TIME.size:
        raise InputFault(TORN)
    seconds, nanoseconds = TIME.unpack_from(content, STAMP_AT)
    return int(seconds * NANOSECONDS_PER_SECOND + nanoseconds)


class FieldReader:
    """The fields of a message, each read once and in their order; InputFault where the message is torn.

    ROS 1 and ROS 2 (CDR) differ in the first bytes, in the end of texts, and in alignment.
    """

    def __init__(self, raw: bytes, is_cdr: bool) -> None:
        if is_cdr and raw[1:2] != _LITTLE_ENDIAN_CDR:
            raise InputFault('a message is not little-endian CDR')
        self._raw, self._is_cdr = raw, is_cdr
        self._at = _CDR_BEGIN if is_cdr else 0

    def align(self, size: int) -> int:
        """Return where the next field begins, which is made of numbers of `size` bytes."""
        if self._is_cdr:
            self._at += -(self._at - _CDR_BEGIN) % size  # counted from after its four bytes
        return self._at

    def unpack(self, fields: struct.Struct, number_size: int) -> Tuple[Any, ...]:
        """Read numbers of `number_size` bytes each."""
        begin = self.align(number_size)
        try:
            numbers = fields.unpack_from(self._raw, begin)
        except struct.error:
            raise InputFault(TORN) from None
        self._at = begin + fields.size
        return numbers

    def length(self) -> int:
        """Read the length of the text or sequence that follows."""
        length: int = self.unpack(LENGTH, LENGTH.size)[0]
        return length

    def content(self, size: int) -> bytes:
        """Read bytes."""
        begin, self._at = self._at, self._at + size
        if self._at > len(self._raw):
            raise InputFault(TORN)
        return self._raw[begin : self._at]

    def text(self, errors: str = 'replace') -> str:
        """Read a string; `errors` says what becomes of bytes that are not UTF-8, as for `bytes.decode`."""
        content = self.content(self.length())
        return content[: len(content) - self._is_cdr].decode('utf-8', errors)  # less CDR's NUL

    def header(self) -> Tuple[int, str]:
        """Read stamp [ns] and frame; InputFault if the nanoseconds lead beyond the latest stamp."""
        if not self._is_cdr:
            self.unpack(UINT32, UINT32.size)  # seq
        seconds, nanoseconds = self.unpack(TIME, UINT32.size)
        stamp_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
        if stamp_ns >= LATEST_NS:
            raise InputFault('a stamp is not before 2^32 s')
        return stamp_ns, self.text()


def _unknown_rows(first: int, last: int) -> bytes:
    """Return the rows of axes that wheels do not measure."""
    return np.diag(np.full(6, UNKNOWN_VARIANCE))[first:last].astype('<f8').tobytes()


# Rows with numbers in some columns, zeros in the others; between them the rows of the axes that are not measured.
_PLANAR = struct.Struct('<2d24xd 2d24xd 144s 2d24xd')
_TWIST = struct.Struct('<d32xd 192s d32xd')
_Z_ROLL_PITCH, _ALL_BUT_X_AND_YAW = _unknown_rows(2, 5), _unknown_rows(1, 5)
_ZEROS = bytes(len(_Z_ROLL_PITCH))


def encode_amcl_covariance(planar: np.ndarray) -> bytes:
    """Encode a 3x3 covariance over (x, y, yaw); the rest is zero, as upstream's amcl has it."""
    (x, y, yaw) = planar.tolist()
    return _PLANAR.pack(*x, *y, _ZEROS, *yaw)


def encode_odometry_covariance(planar: PlanarCovariance) -> bytes:
    """Encode a covariance over (x, y, yaw); the other variances are unknown."""
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = planar
    return _PLANAR.pack(xx, xy, x_yaw, xy, yy, y_yaw, _Z_ROLL_PITCH, x_yaw, y_yaw, yaw_yaw)


def encode_twist_covariance(planar: TwistCovariance) -> bytes:
    """Encode a covariance over (linear x, angular z); the other variances are unknown."""
    linear, together, angular = planar
    return _TWIST.pack(linear, together, _ALL_BUT_X_AND_YAW, together, angular)
