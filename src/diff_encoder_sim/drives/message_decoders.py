"""Decodes messages of ROS 1 and 2; InputFault if one is torn, in a foreign byte order, or has an unusable number."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, Any, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.base.stamps import LATEST_NS, NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import FLOAT32, LENGTH, POSE, SCAN_LIMITS, TIME, TWIST, UINT32
from diff_encoder_sim.wheels.report_link import EncoderSample

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.base.laser_scan import Scan
    from diff_encoder_sim.simulation.state import BodyState

# Those with child_frame_id between header and pose, and those without.
_WITH_CHILD_FRAME = (topics.ODOMETRY_TYPE, topics.TRANSFORM_STAMPED_TYPE)
POSE_TYPES = (*_WITH_CHILD_FRAME, topics.POSE_STAMPED_TYPE, topics.POSE_WITH_COVARIANCE_TYPE)
_WITH_COVARIANCE = (topics.ODOMETRY_TYPE, topics.POSE_WITH_COVARIANCE_TYPE)
_COVARIANCE = struct.Struct('<36d')  # row by row: x, y, z, and rotations about them
_PLANAR = (0, 1, 5, 7, 11, 35)  # of these: xx, xy, x yaw, yy, y yaw, yaw yaw
# Of an Imu: quaternion, its covariance, angular velocity x, y, z, and the first number of its covariance.
_ORIENTATION_AND_RATES = struct.Struct('<17d')
_FARTHEST_M = 1e9  # no robot drives so far; squares of more may not be finite

TORN = 'a message is torn'
NUMBER_SIZE = 8  # of float64 and int64, which CDR aligns to it
# A header begins with its stamp and its frame, after four bytes: ROS 1's seq or CDR's representation.
STAMP_AT, FRAME_AT = 4, 12
_CDR_BEGIN = 4
_LITTLE_ENDIAN_CDR = b'\1'


def _unpack_from(raw: bytes, place: int, fields: struct.Struct) -> Tuple[Any, ...]:
    """Unpack fields of a message."""
    try:
        return fields.unpack_from(raw, place)
    except struct.error:
        raise InputFault(TORN) from None


def encoded_stamp_ns(content: bytes) -> int:
    """Return the stamp of a message that begins with a header."""
    seconds, nanoseconds = _unpack_from(content, STAMP_AT, TIME)
    return int(seconds * NANOSECONDS_PER_SECOND + nanoseconds)


class FieldReader:
    """Reads each field once, in their order: ROS 1 and CDR differ in first bytes, ends of texts, and alignment."""

    def __init__(self, raw: bytes, is_cdr: bool) -> None:
        if is_cdr and raw[1:2] != _LITTLE_ENDIAN_CDR:
            raise InputFault('a message is not little-endian CDR')
        self._raw, self._is_cdr = raw, is_cdr
        self._at = _CDR_BEGIN if is_cdr else 0

    def align(self, size: int) -> int:
        """Return the place of the next field, which is made of numbers of `size` bytes."""
        if self._is_cdr:
            self._at += -(self._at - _CDR_BEGIN) % size  # counted from after its four bytes
        return self._at

    def unpack(self, fields: struct.Struct, number_size: int) -> Tuple[Any, ...]:
        """Read numbers of `number_size` bytes each."""
        begin = self.align(number_size)
        self._at = begin + fields.size
        return _unpack_from(self._raw, begin, fields)

    def length(self) -> int:
        """Read the length of the text or sequence that follows."""
        return int(self.unpack(LENGTH, LENGTH.size)[0])

    def content(self, size: int) -> bytes:
        """Read bytes."""
        begin, self._at = self._at, self._at + size
        if self._at > len(self._raw):
            raise InputFault(TORN)
        return self._raw[begin : self._at]

    def text(self, errors: str = 'replace') -> str:
        """Read a string; `errors` as in `bytes.decode`, for bytes that are not UTF-8."""
        content = self.content(self.length())
        return content[: len(content) - self._is_cdr].decode('utf-8', errors)  # less CDR's NUL

    def header(self) -> Tuple[int, str]:
        """Read stamp [ns] and frame; InputFault if the stamp is beyond the latest."""
        if not self._is_cdr:
            self.unpack(UINT32, UINT32.size)  # seq
        seconds, nanoseconds = self.unpack(TIME, UINT32.size)
        stamp_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
        if stamp_ns >= LATEST_NS:
            raise InputFault('a stamp is not before 2^32 s')
        return stamp_ns, self.text()


class StampedPose(NamedTuple):
    """A child frame's pose in its parent frame at one instant, seen from above."""

    stamp_ns: int
    pose: Pose2D
    parent_frame: str
    child_frame: str  # empty if the message does not name it


class PoseDecoder:
    """Decodes the messages of one topic, of one of `POSE_TYPES`: frames stay the same, so they are only compared."""

    def __init__(self, message_type: str, is_cdr: bool = False) -> None:
        self._has_child = message_type in _WITH_CHILD_FRAME
        self._has_covariance = message_type in _WITH_COVARIANCE
        self._is_cdr = is_cdr
        self._raw_frames = b''  # from the parent frame to the pose
        self._frames = ('', '')
        self._pose_at = 0

    def decode(self, raw: bytes) -> StampedPose:
        """Decode a message."""
        if not self._raw_frames or not raw.startswith(self._raw_frames, FRAME_AT):
            fields = FieldReader(raw, self._is_cdr)
            self._frames = _read_frames(fields, self._has_child)[1:]
            self._pose_at = fields.align(NUMBER_SIZE)
            self._raw_frames = raw[FRAME_AT : self._pose_at]
        pose = planar_pose(*_unpack_from(raw, self._pose_at, POSE))
        return StampedPose(encoded_stamp_ns(raw), pose, *self._frames)

    def decode_covariance(self, raw: bytes) -> List[float]:
        """Decode xx, xy, x yaw, yy, y yaw, yaw yaw of the message decoded last; [] if its type has no covariance."""
        if not self._has_covariance:
            return []
        numbers = _unpack_from(raw, self._pose_at + POSE.size, _COVARIANCE)
        return [numbers[index] for index in _PLANAR]


def decode_tf(raw: bytes, is_cdr: bool = False) -> Iterator[StampedPose]:
    """Decode the poses of a TFMessage, seen from above."""
    fields = FieldReader(raw, is_cdr)
    for _ in range(fields.length()):
        stamp_ns, parent_frame, child_frame = _read_frames(fields, has_child=True)
        yield StampedPose(stamp_ns, planar_pose(*fields.unpack(POSE, NUMBER_SIZE)), parent_frame, child_frame)


def _read_frames(fields: FieldReader, has_child: bool) -> Tuple[int, str, str]:
    stamp_ns, parent_frame = fields.header()
    return stamp_ns, parent_frame.lstrip('/'), fields.text().lstrip('/') if has_child else ''


def planar_pose(x_m: float, y_m: float, z_m: float, qx: float, qy: float, qz: float, qw: float) -> Pose2D:
    """Project a position and a quaternion to the floor; InputFault if a number or the quaternion is not valid."""
    if not abs(x_m) + abs(y_m) + abs(z_m) <= _FARTHEST_M:
        raise InputFault(f'position ({x_m}, {y_m}, {z_m}); expected finite numbers [m]')
    try:
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(qx, qy, qz, qw))
    except ValueError as error:
        raise InputFault(str(error)) from None


class JointDecoder:
    """Decodes the messages of one JointState or EncoderPulse topic: names stay the same, so they are only compared."""

    def __init__(self, message_type: str, is_cdr: bool = False) -> None:
        self._kind = 'q' if message_type == topics.ENCODER_PULSE_TYPE else 'd'
        self._is_cdr = is_cdr
        self._raw_names = b''  # from the frame to the length of the values
        self._names: Tuple[str, ...] = ()
        self._length_at = self._values_at = 0

    def decode(self, raw: bytes) -> Tuple[int, Tuple[str, ...], Sequence[float]]:
        """Decode the stamp [ns], the names, and their values: angles [rad] of a JointState, or pulses."""
        if not self._raw_names or not raw.startswith(self._raw_names, FRAME_AT):
            fields = FieldReader(raw, self._is_cdr)
            fields.header()
            names = tuple(fields.text() for _ in range(fields.length()))
            length_at = fields.align(LENGTH.size)
            fields.length()
            # All at once, so that no part of a torn message is used for the next one.
            self._names, self._raw_names = names, raw[FRAME_AT:length_at]
            self._length_at, self._values_at = length_at, fields.align(NUMBER_SIZE)
        try:
            count = LENGTH.unpack_from(raw, self._length_at)[0]
            # struct keeps the compiled format.
            values = struct.unpack_from(f'<{count}{self._kind}', raw, self._values_at)
        except struct.error:
            raise InputFault(TORN) from None
        return encoded_stamp_ns(raw), self._names, values


def decode_pulses(decoder: JointDecoder, raw: bytes) -> EncoderSample:
    """Decode an EncoderPulse of two counters, left then right, with the decoder of its topic."""
    stamp_ns, _, counts = decoder.decode(raw)
    if len(counts) != 2:
        raise InputFault(f'{len(counts)} counters; expected 2, left then right')
    left, right = counts
    return EncoderSample(stamp_ns, int(left), int(right))


def decode_imu(raw: bytes, is_cdr: bool = False) -> Tuple[int, str, float]:
    """Decode stamp [ns], frame and angular velocity about z [rad/s] of a sensor_msgs/Imu; NaN if it is not measured."""
    fields = FieldReader(raw, is_cdr)
    stamp_ns, frame = fields.header()
    *_, yaw_rate_radps, variance = fields.unpack(_ORIENTATION_AND_RATES, NUMBER_SIZE)
    return stamp_ns, frame, math.nan if variance == -1.0 else yaw_rate_radps


def decode_wheel_speeds(raw: bytes) -> Tuple[int, Tuple[float, float]]:
    """Decode the stamp [ns] and speeds [rad/s] of a JointState of two wheels, left then right."""
    fields = FieldReader(raw, is_cdr=False)
    stamp_ns, _ = fields.header()
    for _ in range(fields.length()):
        fields.text()  # a name
    fields.content(NUMBER_SIZE * fields.length())  # positions
    count = fields.length()
    speeds = struct.unpack(f'<{count}d', fields.content(NUMBER_SIZE * count))
    if len(speeds) != 2 or not all(map(math.isfinite, speeds)):
        raise InputFault(f'velocities {list(speeds)}; expected 2 finite numbers, left then right [rad/s]')
    return stamp_ns, (speeds[0], speeds[1])


def decode_command(raw: bytes, is_cdr: bool = False) -> Tuple[float, float]:
    """Decode a geometry_msgs/Twist: linear [m/s] and angular [rad/s] of a robot on the floor."""
    linear_mps, _, _, _, _, angular_radps = FieldReader(raw, is_cdr).unpack(TWIST, NUMBER_SIZE)
    return linear_mps, angular_radps


def decode_string(raw: bytes, is_cdr: bool = False) -> str:
    """Decode a std_msgs/String."""
    try:
        return FieldReader(raw, is_cdr).text('strict')
    except UnicodeDecodeError:
        raise InputFault('a text is not UTF-8') from None


def decode_scan(raw: bytes, is_cdr: bool = False) -> Tuple[Scan, str]:
    """Decode a LaserScan into the scan and its frame without a leading slash."""
    from diff_encoder_sim.base.laser_scan import Scan  # noqa: PLC0415  # nodes of an encoder import this module

    fields = FieldReader(raw, is_cdr)
    stamp_ns, frame = fields.header()
    angle_min_rad, _, increment_rad, _, _, range_min_m, range_max_m = fields.unpack(SCAN_LIMITS, FLOAT32.itemsize)
    ranges_m = np.frombuffer(fields.content(fields.length() * FLOAT32.itemsize), FLOAT32).astype(float)
    return Scan(stamp_ns, angle_min_rad, increment_rad, range_min_m, range_max_m, ranges_m), frame.lstrip('/')


def decode_model_state(raw: bytes, model: str) -> BodyState:
    """Decode one model's state of a gazebo_msgs/ModelStates of ROS 1, of any simulator."""
    from diff_encoder_sim.simulation.state import BodyState  # noqa: PLC0415  # nodes of an encoder import this module

    fields = FieldReader(raw, is_cdr=False)
    names = [fields.text() for _ in range(fields.length())]
    if model not in names:
        raise InputFault(f'no model {model!r}; expected it among {names}')
    index, poses = names.index(model), fields.content(fields.length() * POSE.size)
    twists = fields.content(fields.length() * TWIST.size)
    pose, twist = _unpack_from(poses, index * POSE.size, POSE), _unpack_from(twists, index * TWIST.size, TWIST)
    return BodyState(pose[:3], pose[3:], twist[:3], twist[3:])
