"""Wheel angles and pulse counts: JointState and EncoderPulse."""

from __future__ import annotations

import math
import struct
from typing import NamedTuple, Sequence, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.field_reader import FRAME_AT, STAMP_AT, TORN, FieldReader
from diff_encoder_sim.drives.message_types import ENCODER_PULSE
from diff_encoder_sim.drives.primitives import LENGTH, NUMBER_SIZE, TIME, encode_header, encode_names, encode_numbers
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.wheels.encoder_sample import EncoderSample


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
        self._kind = 'q' if message_type == ENCODER_PULSE else 'd'
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
