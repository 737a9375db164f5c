"""Messages of wheels, scans, commands, goals and maps."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.pose_messages import encode_planar_pose, encode_pose_stamped
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE
from diff_encoder_sim.drives.wire import (
    FRAME_AT,
    LENGTH,
    NUMBER_SIZE,
    STAMP_AT,
    TIME,
    TORN,
    TWIST,
    FieldReader,
    encode_array,
    encode_header,
    encode_names,
    encode_numbers,
    encode_text,
    encode_time,
    encode_twist,
)

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.base.laser_scan import Scan
    from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
    from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
    from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.wheels.report_link import EncoderSample


def encode_clock(stamp_ns: int) -> bytes:
    """Encode rosgraph_msgs/Clock."""
    return encode_time(stamp_ns)


def encode_command(linear_mps: float, angular_radps: float) -> bytes:
    """Encode geometry_msgs/Twist of a velocity command."""
    return encode_twist((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def decode_command(raw: bytes, is_cdr: bool = False) -> Tuple[float, float]:
    """Decode a geometry_msgs/Twist: linear [m/s] and angular [rad/s] of a robot on the floor.

    Raises:
        InputFault: the message is torn.
    """
    linear_mps, _, _, _, _, angular_radps = FieldReader(raw, is_cdr).unpack(TWIST, NUMBER_SIZE)
    return linear_mps, angular_radps


def encode_string(text: str) -> bytes:
    """Encode std_msgs/String."""
    return encode_text(text)


def decode_string(raw: bytes, is_cdr: bool = False) -> str:
    """Decode a std_msgs/String.

    Raises:
        InputFault: the message is torn, or not UTF-8.
    """
    try:
        return FieldReader(raw, is_cdr).text('strict')
    except UnicodeDecodeError:
        raise InputFault('a text is not UTF-8') from None


_UINT8 = struct.Struct('<B')
# actionlib_msgs/GoalStatus of a goal that is over.
_ACTION_STATUS = {'PREEMPTED': 2, 'SUCCEEDED': 3, 'ABORTED': 4}


class SentGoal(NamedTuple):
    """What distinguishes a goal of an action from others: actionlib_msgs/GoalID."""

    node: str  # that sent it
    number: int  # of its goals, from 1
    stamp_ns: int  # when it was sent


def encode_goal(sent: SentGoal, goal_in_map: Pose2D, goal_stamp_ns: int, map_frame: str) -> bytes:
    """Encode move_base_msgs/MoveBaseActionGoal; `goal_stamp_ns` is of the pose, not of the sending."""
    target = encode_pose_stamped(goal_in_map, goal_stamp_ns, map_frame)
    return encode_header(sent.stamp_ns, '') + _encode_goal_id(sent) + target


def encode_result(sent: SentGoal, status: GoalStatus, text: str, stamp_ns: int) -> bytes:
    """Encode move_base_msgs/MoveBaseActionResult of a goal that is over; MoveBaseResult has no fields."""
    goal_status = _encode_goal_id(sent) + _UINT8.pack(_ACTION_STATUS[status.name]) + encode_text(text)
    return encode_header(stamp_ns, '') + goal_status


def _encode_goal_id(sent: SentGoal) -> bytes:
    """Encode actionlib_msgs/GoalID as actionlib's Python client makes it."""
    stamp_s = sent.stamp_ns / NANOSECONDS_PER_SECOND
    return encode_time(sent.stamp_ns) + encode_text(f'{sent.node}-{sent.number}-{stamp_s:.3f}')


def encode_joint_state(joints: JointStates) -> bytes:
    """Encode sensor_msgs/JointState: wheel angles and speeds; efforts are left out."""
    angles_rad, speeds_radps, names = joints.angles_rad, joints.speeds_radps, encode_names(joints.names)
    # In one piece, as it is the most frequent message but /clock. struct keeps the compiled format.
    fields = f'<4I{len(names)}sI{len(angles_rad)}dI{len(speeds_radps)}dI'
    seconds, nanoseconds = divmod(joints.stamp_ns, NANOSECONDS_PER_SECOND)
    return struct.pack(
        fields, 0, seconds, nanoseconds, 0, names, len(angles_rad), *angles_rad, len(speeds_radps), *speeds_radps, 0
    )


def encode_encoder_pulse(sample: EncoderSample, joints: Tuple[str, str]) -> bytes:
    """Encode diff_encoder_sim/EncoderPulse, left then right; `joints` are their names in that order."""
    pulses = encode_numbers('q', (sample.left_pulses, sample.right_pulses))
    return encode_header(sample.stamp_ns, '') + encode_names(joints) + pulses


def encode_wheel_speeds(stamp_ns: int, speeds_radps: Tuple[float, float], joints: Tuple[str, str]) -> bytes:
    """Encode sensor_msgs/JointState of speeds alone, left then right; `joints` are their names in that order."""
    positions, speeds, efforts = (encode_numbers('d', values) for values in ((), speeds_radps, ()))
    return encode_header(stamp_ns, '') + encode_names(joints) + positions + speeds + efforts


def decode_wheel_speeds(raw: bytes) -> Tuple[int, Tuple[float, float]]:
    """Decode a JointState's stamp [ns] and speeds [rad/s], of two wheels, left then right.

    Raises:
        InputFault: the message is torn, or has not exactly two speeds, or one that is not finite.
    """
    fields = FieldReader(raw, is_cdr=False)
    stamp_ns, _ = fields.header()
    for _ in range(fields.length()):
        fields.content(fields.length())  # a name
    fields.content(NUMBER_SIZE * fields.length())  # positions
    count = fields.length()
    speeds = struct.unpack(f'<{count}d', fields.content(NUMBER_SIZE * count))
    if len(speeds) != 2 or not all(map(math.isfinite, speeds)):
        raise InputFault(f'velocities {list(speeds)}; expected 2 finite numbers, left then right [rad/s]')
    return stamp_ns, (speeds[0], speeds[1])


class JointValues(NamedTuple):
    """Joints at one instant."""

    stamp_ns: int
    names: Tuple[str, ...]
    values: Sequence[float]  # [rad] of a JointState, pulses of an EncoderPulse


class JointDecoder:
    """Decodes the messages of one topic, JointState or EncoderPulse: header, names, and a number for each.

    From message to message names and frame stay the same, so they are compared and not decoded.
    """

    def __init__(self, message_type: str, is_cdr: bool = False) -> None:
        self._kind = 'q' if message_type == ENCODER_PULSE_TYPE else 'd'
        self._is_cdr = is_cdr
        self._raw_names = b''  # from the frame to the length of the values
        self._names: Tuple[str, ...] = ()
        self._length_at = self._values_at = 0

    def decode(self, raw: bytes) -> JointValues:
        """Decode a message.

        Raises:
            InputFault: the message is torn, or in a foreign byte order.
        """
        if not self._raw_names or not raw.startswith(self._raw_names, FRAME_AT):
            self._learn_names(raw)
        try:
            seconds, nanoseconds = TIME.unpack_from(raw, STAMP_AT)
            count = LENGTH.unpack_from(raw, self._length_at)[0]
            # The compiled format is kept by struct itself.
            values = struct.unpack_from(f'<{count}{self._kind}', raw, self._values_at)
        except struct.error:
            raise InputFault(TORN) from None
        return JointValues(seconds * NANOSECONDS_PER_SECOND + nanoseconds, self._names, values)

    def _learn_names(self, raw: bytes) -> None:
        fields = FieldReader(raw, self._is_cdr)
        fields.header()
        names = tuple(fields.text() for _ in range(fields.length()))
        length_at = fields.align(LENGTH.size)
        fields.length()
        # All at once, so that nothing of a torn message is taken for the next one's.
        self._names, self._raw_names = names, raw[FRAME_AT:length_at]
        self._length_at, self._values_at = length_at, fields.align(NUMBER_SIZE)


_RESOLUTION_WIDTH_HEIGHT = struct.Struct('<f2I')


def encode_map(grid: OccupancyGrid, stamp_ns: int, frame: str) -> bytes:
    """Encode nav_msgs/OccupancyGrid, row by row from the origin."""
    return encode_header(stamp_ns, frame) + encode_map_metadata(grid, stamp_ns) + encode_array(grid.cells, 'i1')


def encode_map_metadata(grid: OccupancyGrid, stamp_ns: int) -> bytes:
    """Encode nav_msgs/MapMetaData."""
    size = _RESOLUTION_WIDTH_HEIGHT.pack(grid.resolution_m, grid.width, grid.height)
    return encode_time(stamp_ns) + size + encode_planar_pose(grid.origin)


# angle_min, angle_max, angle_increment, time_increment, scan_time, range_min, range_max.
_LIMITS = struct.Struct('<7f')
_FLOAT32 = np.dtype('<f4')


def encode_scan(scan: Scan, frame: str, period_s: float) -> bytes:
    """Encode sensor_msgs/LaserScan whose rays were all taken at its stamp, one scan each `period_s`."""
    angle_min_rad, increment_rad = scan.angle_min_rad, scan.angle_increment_rad
    angle_max_rad = angle_min_rad + (len(scan.ranges_m) - 1) * increment_rad
    limits = _LIMITS.pack(
        angle_min_rad, angle_max_rad, increment_rad, 0.0, period_s, scan.range_min_m, scan.range_max_m
    )
    ranges = encode_array(scan.ranges_m, _FLOAT32.str)
    return encode_header(scan.stamp_ns, frame) + limits + ranges + encode_numbers('f', ())


def decode_scan(raw: bytes, is_cdr: bool = False) -> Tuple[Scan, str]:
    """Decode a LaserScan into the scan and its frame, which some write with a leading slash.

    Raises:
        InputFault: the message is torn.
    """
    fields = FieldReader(raw, is_cdr)
    stamp_ns, frame = fields.header()
    angle_min_rad, _, increment_rad, _, _, range_min_m, range_max_m = fields.unpack(_LIMITS, _FLOAT32.itemsize)
    ranges = fields.content(fields.length() * _FLOAT32.itemsize)
    ranges_m = np.frombuffer(ranges, _FLOAT32).astype(float)
    from diff_encoder_sim.base.laser_scan import Scan  # noqa: PLC0415  # nodes of an encoder import this module

    return Scan(stamp_ns, angle_min_rad, increment_rad, range_min_m, range_max_m, ranges_m), frame.lstrip('/')
