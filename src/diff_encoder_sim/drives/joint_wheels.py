"""Wheel angles from named joints: from their positions, or from the counts of EncoderPulse."""

from __future__ import annotations

import contextlib
import itertools
import re
from typing import Dict, Iterator, List, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import JointDecoder
from diff_encoder_sim.drives.number_units import TICKS
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, ENCODER_VELOCITY, JOINT_STATE_TYPE
from diff_encoder_sim.drives.wheel_source import WheelNumbers, WheelSeries, WheelSource, ascending_runs
from diff_encoder_sim.wheels.counter import first_counters, next_counters
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import LARGEST_ANGLE_RAD, EncoderParams

MESSAGES_WITH_NAMES = 500  # joints may be in several messages in turn
JOINT_TYPES = (JOINT_STATE_TYPE, ENCODER_PULSE_TYPE)
_SIDES = {'left': {'left', 'l'}, 'right': {'right', 'r'}}


def joint_topics(source: DriveStream, kind: str) -> List[str]:
    """List the topics of one of JOINT_TYPES, without the encoders' speeds, which are a JointState without angles."""
    return sorted(topic for topic, other in source.topics.items() if other == kind and topic != ENCODER_VELOCITY)


def find_wheels(
    source: DriveStream, params: EncoderParams, joint_states: str, pulses: str, left: str, right: str
) -> Tuple[str, str, Tuple[str, str]]:
    """Choose the topic, its type, which is one of JOINT_TYPES, and the joints (left, right) to read.

    The last four arguments are the user's choices of a topic of angles, a topic of counts, and joints. What is empty
    follows from the bag, and from `params` if the bag has these joints. ConfigError lists the alternatives.
    """
    topic, kind = _topic(source, joint_states, pulses)
    decoder = JointDecoder(kind, source.is_cdr)
    names: Dict[str, None] = {}  # in the order of their appearance
    for message in itertools.islice(source.messages((topic,)), MESSAGES_WITH_NAMES):
        with contextlib.suppress(InputFault):  # counted when the drive is read
            names.update(dict.fromkeys(decoder.decode(message.raw)[1]))
    if not names:
        raise ConfigError(f'{source.path}: no message on {topic}; expected {kind}')
    where = f'{source.path}: {topic}'
    choices = ('left', left, params.left_joint), ('right', right, params.right_joint)
    of_left, of_right = (_joint(where, list(names), *choice) for choice in choices)
    if of_left == of_right:
        raise ConfigError(f'{where}: given {of_left} for both wheels; allowed: two of {", ".join(names)}')
    return topic, kind, (of_left, of_right)


def _topic(source: DriveStream, joint_states: str, pulses: str) -> Tuple[str, str]:
    if joint_states and pulses:
        raise ConfigError('--joint-states, --pulses: given both; allowed: one of them')
    choices = ((JOINT_STATE_TYPE, '--joint-states', joint_states), (ENCODER_PULSE_TYPE, '--pulses', pulses))
    for kind, option, given in sorted(choices, key=lambda choice: not choice[2]):  # the given one first
        topics = joint_topics(source, kind)
        if given and source.topics.get(given) != kind:
            found = f'of {source.topics[given]}' if given in source.topics else 'not there'
            allowed = f'a topic of {kind}: {", ".join(topics) or "it has none"}'
            raise ConfigError(f'{source.path}: {option}: given {given}, which is {found}; allowed: {allowed}')
        if not given and len(topics) > 1:
            found = f'{len(topics)} topics of {kind}: {", ".join(topics)}'
            raise ConfigError(f'{source.path}: {found}; expected one, or a choice by {option}')
        if given or topics:
            return given or topics[0], kind
    listed = ', '.join(sorted(source.topics))
    raise ConfigError(f'{source.path}: no topic of {JOINT_STATE_TYPE}, nor of {ENCODER_PULSE_TYPE}; it has {listed}')


def _joint(where: str, names: Sequence[str], side: str, given: str, usual: str) -> str:
    """Choose the joint of one side: as given, else the robot's, else the only wheel whose name has the side in it."""
    if given or usual in names:
        if (given or usual) in names:
            return given or usual
        raise ConfigError(f'{where}: --{side}: given {given!r}; allowed: {", ".join(names)}')
    wheels = [name for name in names if 'wheel' in name.lower()]
    found = [name for name in wheels if _SIDES[side] & set(re.split('[^a-z]+', name.lower()))]
    if len(wheels) != 2 or len(found) != 1:
        raise ConfigError(f'{where}: no joint {usual!r}; expected --{side}, one of {", ".join(names)}')
    return found[0]


class JointWheels(WheelSource):
    """Reads the angles of two joints, which may be in one message or in several in turn."""

    are_joint_angles = True

    def __init__(self, topic: str, joints: Tuple[str, str], is_cdr: bool) -> None:
        """Prepare to read a topic of JointState."""
        super().__init__([topic], joints, f'messages of {topic} ({", ".join(joints)})')
        self._decoder = JointDecoder(JOINT_STATE_TYPE, is_cdr)
        self._names: Tuple[str, ...] = ()  # of the last message
        self._indices: List[Tuple[int, int]] = []  # sides in it, and indices of their joints

    def add(self, message: Message) -> None:
        """Add the angles of a message."""
        stamp_ns, names, values = self._decoder.decode(message.raw)
        if names is not self._names:
            for joint in self.joints:
                if names.count(joint) > 1:
                    raise InputFault(f'joint {joint!r} is named {names.count(joint)} times in one message')
            self._indices = [(side, names.index(joint)) for side, joint in enumerate(self.joints) if joint in names]
            self._names = names
        if len(values) < len(names):
            raise InputFault(f'{len(names)} names, {len(values)} positions; expected a position of each joint')
        for side, index in self._indices:
            if not abs(values[index]) <= LARGEST_ANGLE_RAD:
                given = f'joint {self.joints[side]!r} has position {values[index]}'
                raise InputFault(f'{given}; expected a finite angle [rad]')
        for side, index in self._indices:
            self._append(side, stamp_ns, message.time_ns, values[index])


class PulseWheels(WheelSource):
    """Reads the counts of a topic of EncoderPulse."""

    def __init__(
        self, topic: str, joints: Tuple[str, str], is_cdr: bool, odometry: OdometryParams, about: str, notes: List[str]
    ) -> None:
        """Prepare to read counts of the resolution and the modulus in `odometry`; `notes` are their limits."""
        numbers = WheelNumbers(TICKS, odometry.wheel_diameter.radii_m, odometry.counts_per_turn)
        super().__init__([topic], joints, f'messages of {topic} ({", ".join(joints)}; {about})', numbers)
        self.restarts = 0  # of the counters
        self._limits, self._notes = odometry.counter_limits, notes
        self._decoder = JointDecoder(ENCODER_PULSE_TYPE, is_cdr)

    def add(self, message: Message) -> None:
        """Add the counts of a message."""
        stamp_ns, names, counts = self._decoder.decode(message.raw)
        by_name = dict(zip(names, counts))
        if any(joint not in by_name or names.count(joint) > 1 for joint in self.joints):
            raise InputFault(f'names {list(names)}; expected {" and ".join(self.joints)}, each once')
        for side, joint in enumerate(self.joints):
            self._append(side, stamp_ns, message.time_ns, by_name[joint])

    def _series(self) -> List[WheelSeries]:
        """Return the counts without wraps; rotation during a restart of the counters is lost."""
        left, right = super()._series()
        counts = np.column_stack((left.values, right.values)).astype(np.int64)
        totals = np.zeros(counts.shape)
        self.restarts = 0
        for rows in filter(len, ascending_runs(left.stamps_ns)):
            readings = [*zip(left.stamps_ns[rows].tolist(), *counts[rows].T.tolist())]
            counters = first_counters(self._limits, *readings[0])
            totals[rows] = counts[rows[0]]
            for row, reading in zip(rows[1:].tolist(), readings[1:]):
                counters, cause = next_counters(self._limits, counters, *reading)
                self.restarts += bool(cause)
                totals[row] += counters.total[1:]
        return [side._replace(values=of_side) for side, of_side in zip((left, right), totals.T)]

    def notes(self) -> Iterator[str]:
        """List the limits of the counts, and the restarts of their counters."""
        yield from self._notes
        yield from super().notes()
        if self.restarts:
            lost = 'rotation meanwhile is lost (a wrong counter_modulus looks the same)'
            yield f'{self.topics[0]}: counter restarts: {self.restarts}; {lost}'
