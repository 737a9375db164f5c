"""Wheel angles from any two numbers in the messages of a bag: from one topic, or paired from two."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Deque, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.message_fields import MessageField
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.wheel_units import WheelAngle, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel

# Across a longer gap nobody knows how a wheel has turned.
LONGEST_GAP_NS = NANOSECONDS_PER_SECOND

LEFT, RIGHT = 0, 1


class _Angle(NamedTuple):
    stamp_ns: int
    angle_rad: float


class PairedAngles:
    """Gives both wheels at the stamps of the left one, the right one interpolated between the two around it.

    Keeps no more than a second of either.
    """

    def __init__(self) -> None:
        self._sides: Tuple[Deque[_Angle], Deque[_Angle]] = (deque(), deque())
        self._newest_ns: List[Optional[int]] = [None, None]
        self._has_paired = False
        self.left_out = 0  # angles of the left wheel since the first pair that the right one has none near

    def add(self, side: int, stamp_ns: int, angle_rad: float) -> List[Tuple[int, float, float]]:
        """Take an angle of one side, LEFT or RIGHT, and return the instants that it completes: stamp, left, right."""
        newest_ns = self._newest_ns[side]
        if newest_ns is not None and newest_ns - LONGEST_GAP_NS <= stamp_ns <= newest_ns:
            return []  # repeated, or overtaken
        if newest_ns is not None and stamp_ns < newest_ns:  # time was set back
            self._restart()
        self._newest_ns[side] = stamp_ns
        self._sides[side].append(_Angle(stamp_ns, angle_rad))
        self._forget()
        return self._pairs()

    def _restart(self) -> None:
        self._newest_ns = [None, None]
        for of_side in self._sides:
            of_side.clear()

    def _forget(self) -> None:
        """Drop what is too old to be paired."""
        for of_side in self._sides:
            while len(of_side) > 1 and of_side[0].stamp_ns < of_side[-1].stamp_ns - LONGEST_GAP_NS:
                of_side.popleft()
                self.left_out += self._has_paired and of_side is self._sides[LEFT]

    def _pairs(self) -> List[Tuple[int, float, float]]:
        lefts, rights = self._sides
        pairs = []
        while lefts and rights and lefts[0].stamp_ns <= rights[-1].stamp_ns:
            left = lefts.popleft()
            while len(rights) > 1 and rights[1].stamp_ns <= left.stamp_ns:
                rights.popleft()
            if rights[0].stamp_ns > left.stamp_ns:  # the right wheel begins later, or was away
                self.left_out += self._has_paired
                continue
            self._has_paired = True
            pairs.append((left.stamp_ns, left.angle_rad, _between(rights[0], rights[min(1, len(rights) - 1)], left)))
        return pairs


def _between(older: _Angle, newer: _Angle, at: _Angle) -> float:
    if older.stamp_ns == at.stamp_ns:
        return older.angle_rad
    fraction = (at.stamp_ns - older.stamp_ns) / (newer.stamp_ns - older.stamp_ns)
    return older.angle_rad + fraction * (newer.angle_rad - older.angle_rad)


class ReceiveTimes:
    """Mean and standard deviation of the intervals between the messages of a topic, as they come."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._last_ns: Optional[int] = None
        self._count, self._mean_ns, self._squares = 0, 0.0, 0.0

    def add(self, time_ns: int) -> None:
        """Take the next message."""
        if self._last_ns is not None:
            self._count += 1
            interval_ns = time_ns - self._last_ns
            deviation_ns = interval_ns - self._mean_ns
            self._mean_ns += deviation_ns / self._count
            self._squares += deviation_ns * (interval_ns - self._mean_ns)
        self._last_ns = time_ns

    def text(self) -> str:
        """Return mean and standard deviation."""
        std_ns = math.sqrt(self._squares / self._count) if self._count else 0.0
        return f'{self.topic} every {1e-6 * self._mean_ns:.1f} ms +- {1e-6 * std_ns:.1f} ms'


def receive_times_note(times: Sequence[ReceiveTimes]) -> str:
    """Say in one line what the stamps of the topics are."""
    return (
        f'no stamps: the times of receipt are used, of {" and ".join(each.text() for each in times)} (mean, standard '
        f'deviation); this jitter is in speeds and comparisons, not in the counts'
    )


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
