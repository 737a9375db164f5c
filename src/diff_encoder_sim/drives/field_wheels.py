"""Wheel angles from any two numbers in the messages of a bag."""

from __future__ import annotations

from typing import Any, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.message_fields import MessageField
from diff_encoder_sim.drives.paired_angles import LONGEST_GAP_NS, PairedAngles
from diff_encoder_sim.drives.receive_times import ReceiveTimes, receive_times_note
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.wheel_units import WheelAngle, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel


class Wheel(NamedTuple):
    """One wheel in a bag."""

    joint: str  # under which its angles are given
    field: MessageField
    unit: WheelUnit


class FieldWheels:
    """Reads both wheels, from one topic or from two."""

    are_joint_angles = False

    def __init__(
        self, left: Wheel, right: Wheel, ppr: Optional[PerWheel], about: str, notes: Sequence[str] = ()
    ) -> None:
        """Prepare to read.

        Args:
            left: the left wheel.
            right: the right wheel.
            ppr: of counts.
            about: what the numbers are, for the reader.
            notes: what the angles cannot show.
        """
        self.joints, self.ppr = (left.joint, right.joint), ppr
        self.topics: Tuple[str, ...] = tuple(dict.fromkeys((left.field.topic, right.field.topic)))
        self.text = f'messages of {left.field.name}, {right.field.name} ({about})'
        self._notes = notes
        self._fields = (left.field, right.field)
        self._wheels = (WheelAngle(left.unit), WheelAngle(right.unit))
        self._pairs = PairedAngles()
        self._received: List[ReceiveTimes] = []
        if not (left.field.has_header and right.field.has_header):
            self._use_receive_times()

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return both wheels wherever the message completes them.

        Raises:
            InputFault: it is torn, or a number is not finite.
        """
        sides = [side for side, field in enumerate(self._fields) if field.topic == message.topic]
        decoded = self._fields[sides[0]].message.decode(message.raw)
        stamp_ns = self._stamp_ns(message, decoded)
        values = [self._fields[side].value(decoded) for side in sides]
        angles_rad = [self._wheels[side].angle_rad(stamp_ns, value) for side, value in zip(sides, values)]
        if len(sides) > 1:
            return (JointValues(stamp_ns, self.joints, angles_rad),)
        pairs = self._pairs.add(sides[0], stamp_ns, angles_rad[0])
        return [JointValues(pair_ns, self.joints, pair_rad) for pair_ns, *pair_rad in pairs]

    def notes(self) -> Iterator[str]:
        """List stamps that are those of receipt, and what could not be paired."""
        if self._received:
            yield receive_times_note(self._received)
        yield from self._notes
        if self._pairs.left_out:
            left, right = (field.name for field in self._fields)
            gap_s = LONGEST_GAP_NS / NANOSECONDS_PER_SECOND
            yield f'left out: {self._pairs.left_out} values of {left} that have none of {right} within {gap_s:g} s'

    def _use_receive_times(self) -> None:
        self._received = [ReceiveTimes(topic) for topic in self.topics]

    def _stamp_ns(self, message: Message, decoded: Any) -> int:
        """Return the stamp, or when the message was received, where topics have no stamps or leave them at 0."""
        if not self._received:
            stamp = decoded.header.stamp
            stamp_ns = int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
            if stamp_ns or message.time_ns < NANOSECONDS_PER_SECOND:  # a simulation begins at 0
                return stamp_ns
            self._use_receive_times()
        for times in self._received:
            if times.topic == message.topic:
                times.add(message.time_ns)
        return message.time_ns
