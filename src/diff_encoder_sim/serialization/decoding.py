"""What reencoding needs of serialised messages: wheel angles, pulse counts, and poses.

A drive has hundreds of messages a second, and rosbags' decoder of every field takes longer than
all that is done with them; here only what is wanted is decoded. ROS 1 and ROS 2 (CDR) differ in
the first bytes, in the end of texts, and in alignment.
"""

from __future__ import annotations

import math
import struct
from typing import Iterator, NamedTuple, Sequence, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.serialization.message_types import (
    ENCODER_PULSE,
    ODOMETRY,
    POSE_STAMPED,
    POSE_WITH_COVARIANCE,
    TRANSFORM_STAMPED,
)

POSE_TYPES = (ODOMETRY, POSE_STAMPED, POSE_WITH_COVARIANCE, TRANSFORM_STAMPED)
# Those with child_frame_id between header and pose.
_WITH_CHILD_FRAME = (ODOMETRY, TRANSFORM_STAMPED)

# Before the header's frame stand its stamp and, of four bytes, ROS 1's seq or CDR's representation.
_STAMP_AT, _FRAME_AT = 4, 12
_CDR_BEGIN = 4
# No robot comes so far; squares of more may not be finite.
_FARTHEST_M = 1e9
_LENGTH, _STAMP, _POSE = struct.Struct('<I'), struct.Struct('<2I'), struct.Struct('<7d')


class JointValues(NamedTuple):
    """Joints at one instant."""

    stamp_ns: int
    names: Tuple[str, ...]
    values: Sequence[float]  # [rad] of a JointState, pulses of an EncoderPulse


class StampedPose(NamedTuple):
    """A child frame's pose in its parent, seen from above."""

    stamp_ns: int
    parent_frame: str
    child_frame: str  # empty where the message does not tell
    pose: Pose2D


class JointDecoder:
    """Of JointState, or of EncoderPulse: both are a header, names, and a number for each.

    From message to message names and frame stay the same, so they are compared and not decoded.
    """

    def __init__(self, message_type: str, is_cdr: bool) -> None:
        self._kind = 'q' if message_type == ENCODER_PULSE else 'd'
        self._is_cdr = is_cdr
        self._beginning = b''  # from the frame to the names
        self._values_at = self._first_value_at = 0
        self._names: Tuple[str, ...] = ()

    def decode(self, raw: bytes) -> JointValues:
        """What a message says of its joints.

        Raises:
            InputFault: the message is torn, or in a foreign byte order.
        """
        try:
            if not self._beginning or not raw.startswith(self._beginning, _FRAME_AT):
                self._learn(raw)
            seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_AT)
            count = _LENGTH.unpack_from(raw, self._values_at)[0]
            # The compiled format is kept by struct itself.
            values = struct.unpack_from(f'<{count}{self._kind}', raw, self._first_value_at)
        except struct.error:
            raise InputFault('a message is torn') from None
        return JointValues(seconds * NANOSECONDS_PER_SECOND + nanoseconds, self._names, values)

    def _learn(self, raw: bytes) -> None:
        fields = _Fields(raw, self._is_cdr)
        fields.header()
        names = tuple(fields.text() for _ in range(fields.length()))
        values_at = fields.place(_LENGTH.size)
        fields.length()
        # All at once, so that nothing of a torn message is taken for the next one's.
        self._names, self._beginning = names, raw[_FRAME_AT:values_at]
        self._values_at, self._first_value_at = values_at, fields.place(8)


def decode_pose(message_type: str, raw: bytes, is_cdr: bool) -> StampedPose:
    """The pose of a message of one of `POSE_TYPES`.

    Raises:
        InputFault: the message is torn, or its pose is not finite.
    """
    try:
        return _Fields(raw, is_cdr).pose(has_child=message_type in _WITH_CHILD_FRAME)
    except struct.error:
        raise InputFault('a message is torn') from None


def decode_transforms(raw: bytes, is_cdr: bool) -> Iterator[StampedPose]:
    """The poses of a TFMessage.

    Raises:
        InputFault: the message is torn, or a pose is not finite.
    """
    try:
        fields = _Fields(raw, is_cdr)
        for _ in range(fields.length()):
            yield fields.pose(has_child=True)
    except struct.error:
        raise InputFault('a message is torn') from None


class _Fields:
    """A message's fields, one after the other."""

    def __init__(self, raw: bytes, is_cdr: bool) -> None:
        if is_cdr and not raw[1:2] == b'\1':
            raise InputFault('a message is not little-endian CDR')
        self._raw, self._is_cdr = raw, is_cdr
        self._at = _CDR_BEGIN if is_cdr else 0

    def place(self, size: int) -> int:
        """Where the next field begins, which is a number of `size` bytes."""
        if self._is_cdr:
            self._at += -(self._at - _CDR_BEGIN) % size  # counted from after its four bytes
        return self._at

    def length(self) -> int:
        """Of the sequence that follows."""
        self._at = self.place(_LENGTH.size) + _LENGTH.size
        return _LENGTH.unpack_from(self._raw, self._at - _LENGTH.size)[0]

    def text(self) -> str:
        begin = self.place(_LENGTH.size) + _LENGTH.size
        self._at = begin + _LENGTH.unpack_from(self._raw, begin - _LENGTH.size)[0]
        return self._raw[begin : self._at - self._is_cdr].decode('utf-8', 'replace')  # less its NUL

    def header(self) -> Tuple[int, str]:
        """Stamp [ns] and frame."""
        begin = self.place(_LENGTH.size) + (0 if self._is_cdr else _LENGTH.size)
        seconds, nanoseconds = _STAMP.unpack_from(self._raw, begin)
        self._at = begin + _STAMP.size
        return seconds * NANOSECONDS_PER_SECOND + nanoseconds, self.text()

    def pose(self, has_child: bool) -> StampedPose:
        """What begins with a header, perhaps a child frame, and a pose or a transform."""
        stamp_ns, parent_frame = self.header()
        child_frame = self.text() if has_child else ''
        x_m, y_m, _, *quat_xyzw = _POSE.unpack_from(self._raw, self.place(8))
        self._at += _POSE.size
        try:
            pose = Pose2D(x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw))
        except ValueError as error:
            raise InputFault(str(error)) from None
        if not math.hypot(x_m, y_m) <= _FARTHEST_M:
            raise InputFault(f'no position: ({x_m}, {y_m})')
        return StampedPose(stamp_ns, parent_frame.lstrip('/'), child_frame.lstrip('/'), pose)
