"""Wheel angles from named joints: from their positions, or from the counts of EncoderPulse."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.sensor_messages import JointDecoder
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, ENCODER_VELOCITY, JOINT_STATE_TYPE
from diff_encoder_sim.drives.wheel_source import (
    LONGEST_GAP_NS,
    TimedDrive,
    WheelNumbers,
    angles_of_counts_rad,
    ascending_runs,
    paired_drives,
)
from diff_encoder_sim.wheels.counter import CounterSteps, Reading
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import LARGEST_ANGLE_RAD, EncoderParams

# Joints may come in several messages in turn, so more than the first are read for their names.
MESSAGES_WITH_NAMES = 500

JOINT_TYPES = (JOINT_STATE_TYPE, ENCODER_PULSE_TYPE)

_SIDES = {'left': {'left', 'l'}, 'right': {'right', 'r'}}


class WheelTopic(NamedTuple):
    """The topic of the wheels' angles or counts."""

    topic: str
    message_type: str  # one of JOINT_TYPES
    joints: Tuple[str, str]  # left, right
    ppr: Optional[PerWheel]  # of counts


class WheelOptions(NamedTuple):
    """What the user has chosen; empty if it follows from the bag."""

    joint_states: str = ''
    pulses: str = ''
    pulses_ppr: Optional[PerWheel] = None
    left_joint: str = ''
    right_joint: str = ''


def joint_topics(source: BagSource, kind: str) -> List[str]:
    """List the topics of one of JOINT_TYPES, without the encoders' speeds, which are a JointState without angles."""
    return sorted(topic for topic, other in source.topics.items() if other == kind and topic != ENCODER_VELOCITY)


def find_wheels(path: Path, source: BagSource, options: WheelOptions, params: EncoderParams) -> WheelTopic:
    """Choose the topic and the joints to read.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        options: what is chosen already.
        params: of the robot, whose joints are taken if the bag has them.

    Raises:
        ConfigError: there is none, or a choice to make; it lists the alternatives.
    """
    topic, kind = _topic(path, source, options)
    names = _names(source, topic, kind)
    if not names:
        raise ConfigError(f'{path}: no message on {topic}; expected {kind}')
    left = _joint(path, topic, names, 'left', options.left_joint, params.left_joint)
    right = _joint(path, topic, names, 'right', options.right_joint, params.right_joint)
    if left == right:
        raise ConfigError(f'{path}: {topic}: given {left} for both wheels; allowed: two of {", ".join(names)}')
    if kind == JOINT_STATE_TYPE:
        return WheelTopic(topic, kind, (left, right), None)
    if options.pulses_ppr is None:
        missing = 'expected --pulses-ppr, the pulses per revolution of their encoder'
        raise ConfigError(f'{path}: {topic} has counts; {missing}')
    return WheelTopic(topic, kind, (left, right), options.pulses_ppr)


def _topic(path: Path, source: BagSource, options: WheelOptions) -> Tuple[str, str]:
    if options.joint_states and options.pulses:
        raise ConfigError('--joint-states, --pulses: given both; allowed: one of them')
    choices = (
        (JOINT_STATE_TYPE, '--joint-states', options.joint_states),
        (ENCODER_PULSE_TYPE, '--pulses', options.pulses),
    )
    for kind, option, given in choices:
        if given and source.topics.get(given) != kind:
            found = f'of {source.topics[given]}' if given in source.topics else 'not there'
            listed = ', '.join(joint_topics(source, kind)) or 'it has none'
            raise ConfigError(
                f'{path}: {option}: given {given}, which is {found}; allowed: a topic of {kind}: {listed}'
            )
        if given:
            return given, kind
    for kind, option, _ in choices:
        topics = joint_topics(source, kind)
        if len(topics) > 1:
            listed = ', '.join(topics)
            raise ConfigError(
                f'{path}: {len(topics)} topics of {kind}: {listed}; expected one, or a choice by {option}'
            )
        if topics:
            return topics[0], kind
    listed = ', '.join(sorted(source.topics))
    raise ConfigError(f'{path}: no topic of {JOINT_STATE_TYPE}, nor of {ENCODER_PULSE_TYPE}; it has {listed}')


def _names(source: BagSource, topic: str, kind: str) -> List[str]:
    """List the joints, in the order of their appearance."""
    decoder = JointDecoder(kind, source.is_cdr)
    names: Dict[str, None] = {}
    for message in itertools.islice(source.messages((topic,)), MESSAGES_WITH_NAMES):
        try:
            names.update(dict.fromkeys(decoder.decode(message.raw).names))
        except InputFault:
            continue  # counted when the drive is read
    return list(names)


def _joint(path: Path, topic: str, names: Sequence[str], side: str, given: str, usual: str) -> str:
    """Choose the joint of one side: as given, else the robot's, else the only wheel whose name has the side in it."""
    if given or usual in names:
        if (given or usual) in names:
            return given or usual
        raise ConfigError(f'{path}: {topic}: --{side}: given {given!r}; allowed: {", ".join(names)}')
    wheels = [name for name in names if 'wheel' in name.lower()]
    found = [name for name in wheels if _SIDES[side] & set(re.split('[^a-z]+', name.lower()))]
    if len(wheels) != 2 or len(found) != 1:
        raise ConfigError(f'{path}: {topic}: no joint {usual!r}; expected --{side}, one of {", ".join(names)}')
    return found[0]


class JointWheels:
    """Reads the angles of two joints, which may be in one message or in several in turn."""

    are_joint_angles = True
    ppr: Optional[PerWheel] = None  # angles are not counted

    def __init__(self, wheels: WheelTopic, is_cdr: bool) -> None:
        """Prepare to read the topic that `find_wheels` has found."""
        self.topics: Tuple[str, ...] = (wheels.topic,)
        self.joints = wheels.joints
        self.text = f'messages of {wheels.topic} ({", ".join(wheels.joints)})'
        self._decoder = JointDecoder(wheels.message_type, is_cdr)
        self._sides = WheelNumbers(), WheelNumbers()
        self._seen_ns: Dict[str, int] = {}  # by joint
        self._names: Tuple[str, ...] = ()  # of the last message
        self._indices: List[Tuple[int, int]] = []  # of the sides that it has, and of their joints in it
        self._left_out = 0

    def add(self, message: Message) -> None:
        """Add the angles of one message.

        Raises:
            InputFault: the message is torn, a wheel is named twice or without a finite angle, or has long been missing.
        """
        stamp_ns, names, values = self._decoder.decode(message.raw)
        if names is not self._names:
            twice = next((joint for joint in self.joints if names.count(joint) > 1), None)
            if twice:
                raise InputFault(f'joint {twice!r} is named {names.count(twice)} times in one message')
            self._names = names
            self._indices = [(side, names.index(joint)) for side, joint in enumerate(self.joints) if joint in names]
        for side, index in self._indices:
            if index >= len(values):
                raise InputFault(
                    f'joint {self.joints[side]!r} has no position: {len(names)} names, {len(values)} positions'
                )
            if not abs(values[index]) <= LARGEST_ANGLE_RAD:
                raise InputFault(
                    f'joint {self.joints[side]!r} has position {values[index]}; expected a finite angle [rad]'
                )
        for side, index in self._indices:
            self._sides[side].add(stamp_ns, message.time_ns, values[index])
        if len(self._indices) < 2:
            self._check_nothing_missing(stamp_ns, names)

    def _check_nothing_missing(self, stamp_ns: int, names: Sequence[str]) -> None:
        for joint in self.joints:
            missing_ns = stamp_ns - self._seen_ns.setdefault(joint, stamp_ns)
            if joint in names or missing_ns < 0:
                self._seen_ns[joint] = stamp_ns
            elif missing_ns > LONGEST_GAP_NS:
                missing_s = missing_ns / NANOSECONDS_PER_SECOND
                raise InputFault(f'joint {joint!r} not seen for {missing_s:.1f} s; this message names {list(names)}')

    def drives(self) -> List[TimedDrive]:
        """Return both wheels at the stamps of the left one."""
        drives, self._left_out = paired_drives(*(side.series() for side in self._sides))
        return drives

    def notes(self) -> Iterator[str]:
        """List what could not be paired."""
        if self._left_out:
            yield f'left out: {self._left_out} angles of {self.joints[0]} without one of {self.joints[1]} near them'


class PulseWheels:
    """Reads the counts of a topic."""

    are_joint_angles = False

    def __init__(
        self,
        topic: str,
        joints: Tuple[str, str],
        is_cdr: bool,
        odometry: OdometryParams,
        about: str,
        notes: Sequence[str],
    ) -> None:
        """Prepare to read.

        Args:
            topic: of EncoderPulse.
            joints: left, right.
            is_cdr: of ROS 2.
            odometry: which could be fed with the counts: their resolution, where they wrap, how fast wheels can turn.
            about: how the counts are read, for the reader.
            notes: what the counts cannot show.
        """
        self.topics: Tuple[str, ...] = (topic,)
        self.joints = joints
        self.ppr: Optional[PerWheel] = odometry.counts_per_turn
        self.text = f'messages of {topic} ({", ".join(joints)}; {about})'
        self.restarts = 0  # of the counters
        self._odometry, self._notes = odometry, notes
        self._decoder = JointDecoder(ENCODER_PULSE_TYPE, is_cdr)
        self._sides = WheelNumbers(), WheelNumbers()

    def add(self, message: Message) -> None:
        """Add the counts of one message.

        Raises:
            InputFault: the message is torn, or has not one count of each wheel.
        """
        stamp_ns, names, counts = self._decoder.decode(message.raw)
        by_name = dict(zip(names, counts))
        if any(joint not in by_name or names.count(joint) > 1 for joint in self.joints):
            raise InputFault(f'names {list(names)}; expected {" and ".join(self.joints)}, each once')
        for side, joint in zip(self._sides, self.joints):
            side.add(stamp_ns, message.time_ns, by_name[joint])

    def drives(self) -> List[TimedDrive]:
        """Return the angles; what the wheels turned while the counters restarted is lost."""
        left, right = (side.series() for side in self._sides)
        counted = np.zeros((len(left.values), 2))
        steps, self.restarts = CounterSteps(self._odometry.counter_limits), 0
        for rows in ascending_runs(left.stamps_ns):
            steps.reset()
            totals = 0, 0
            stamps_ns, counts = left.stamps_ns[rows].tolist(), np.column_stack((left.values, right.values))[rows]
            for row, stamp_ns, pair in zip(rows.tolist(), stamps_ns, counts.astype(np.int64).tolist()):
                step = steps.take(Reading(stamp_ns, *pair))
                if step is None:
                    totals = pair[0], pair[1]
                else:
                    totals = totals[0] + step.left_pulses, totals[1] + step.right_pulses
                    self.restarts += bool(step.restart)
                counted[row] = totals
        ppr = self._odometry.counts_per_turn
        left_rad = angles_of_counts_rad(counted[:, 0], ppr.left)
        right_rad = angles_of_counts_rad(counted[:, 1], ppr.right)
        return paired_drives(left._replace(values=left_rad), right._replace(values=right_rad))[0]

    def notes(self) -> Iterator[str]:
        """List what the counts cannot show, and how often their counters restarted."""
        yield from self._notes
        if self.restarts:
            yield (
                f'{self.topics[0]}: counter restarts: {self.restarts}; what the wheels turned meanwhile is '
                f'lost. Counters that wrap elsewhere than at their counter_modulus look like that, too'
            )
