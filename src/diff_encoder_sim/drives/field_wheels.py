"""Wheel angles from any two numbers in the messages of a bag: from one topic, or paired from two."""

from __future__ import annotations

from array import array
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import Message
from diff_encoder_sim.drives.message_fields import MessageField
from diff_encoder_sim.drives.wheel_source import (
    LONGEST_GAP_NS,
    TimedDrive,
    WheelNumbers,
    WheelUnit,
    paired_drives,
    receive_times_note,
    wheel_angles,
)
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
        self._wheels = left, right
        self._numbers = WheelNumbers(), WheelNumbers()
        self._received_ns: Dict[str, array[int]] = {topic: array('q') for topic in self.topics}
        self._has_stamps = left.field.has_header and right.field.has_header
        self._left_out = 0

    def add(self, message: Message) -> None:
        """Add the numbers of a message.

        Raises:
            InputFault: it is torn, or a number is not finite.
        """
        sides = [side for side, wheel in enumerate(self._wheels) if wheel.field.topic == message.topic]
        decoded = self._wheels[sides[0]].field.message.decode(message.raw)
        values = [self._wheels[side].field.value(decoded) for side in sides]
        stamp_ns = message.time_ns
        if self._has_stamps:
            stamp = decoded.header.stamp
            stamp_ns = int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
            if not stamp_ns and message.time_ns >= NANOSECONDS_PER_SECOND:  # a simulation begins at 0
                self._has_stamps, stamp_ns = False, message.time_ns
        for side, value in zip(sides, values):
            self._numbers[side].add(stamp_ns, message.time_ns, value)
        self._received_ns[message.topic].append(message.time_ns)

    def drives(self) -> List[TimedDrive]:
        """Return both wheels at the stamps of the left one, or at times of receipt if a topic has no stamps."""
        series = (numbers.series() for numbers in self._numbers)
        stamped = [one if self._has_stamps else one._replace(stamps_ns=one.times_ns) for one in series]
        left, right = (wheel_angles(one, wheel.unit) for one, wheel in zip(stamped, self._wheels))
        drives, self._left_out = paired_drives(left, right)
        return drives

    def notes(self) -> Iterator[str]:
        """List stamps that are those of receipt, and what could not be paired."""
        if not self._has_stamps:
            yield receive_times_note(self._received_ns)
        yield from self._notes
        if self._left_out:
            left, right = (wheel.field.name for wheel in self._wheels)
            gap_s = LONGEST_GAP_NS / NANOSECONDS_PER_SECOND
            yield f'left out: {self._left_out} values of {left} that have none of {right} within {gap_s:g} s'
