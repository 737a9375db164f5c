"""Wheel angles from JointState, or from the counts of EncoderPulse: where they are in a bag, and how they are read."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.message_types import ENCODER_PULSE, JOINT_STATE
from diff_encoder_sim.drives.sensor_messages import JointDecoder, JointValues
from diff_encoder_sim.drives.topics import ENCODER_VELOCITY
from diff_encoder_sim.drives.wheel_units import CountedAngles
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# Joints may come in several messages in turn, so more than the first are read for their names.
MESSAGES_WITH_NAMES = 500

JOINT_TYPES = (JOINT_STATE, ENCODER_PULSE)

_SIDES = {'left': {'left', 'l'}, 'right': {'right', 'r'}}


class WheelTopic(NamedTuple):
    """Where the wheels' angles come from."""

    topic: str
    message_type: str  # JOINT_STATE or ENCODER_PULSE
    joints: Tuple[str, str]  # left, right
    ppr: Optional[PerWheel]  # of counts


class WheelOptions(NamedTuple):
    """What the user has chosen; empty where it follows from the bag."""

    joint_states: str = ''
    pulses: str = ''
    pulses_ppr: Optional[PerWheel] = None
    left_joint: str = ''
    right_joint: str = ''


def has_joints(source: BagSource) -> bool:
    """Return whether a bag has a topic of the joints' angles or counts."""
    return any(_topics_of(source, kind) for kind in JOINT_TYPES)


def find_wheels(path: Path, source: BagSource, options: WheelOptions, params: EncoderParams) -> WheelTopic:
    """Choose the topic and the joints to read.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        options: what is chosen already.
        params: of the robot, whose joints are taken where the bag has them.

    Raises:
        ConfigError: there is none, or a choice to make; it lists what there is.
    """
    topic, kind = _topic(path, source, options)
    joints = _joints(path, source, topic, kind, options, params)
    if kind == JOINT_STATE:
        return WheelTopic(topic, kind, joints, None)
    if options.pulses_ppr is None:
        missing = 'expected --pulses-ppr, the pulses per revolution of their encoder'
        raise ConfigError(f'{path}: {topic} has counts; {missing}')
    return WheelTopic(topic, kind, joints, options.pulses_ppr)


def _topic(path: Path, source: BagSource, options: WheelOptions) -> Tuple[str, str]:
    if options.joint_states and options.pulses:
        raise ConfigError('--joint-states, --pulses: given both; allowed: one of them')
    if options.pulses:
        return _given_topic(path, source, options.pulses, ENCODER_PULSE, '--pulses'), ENCODER_PULSE
    if options.joint_states:
        return _given_topic(path, source, options.joint_states, JOINT_STATE, '--joint-states'), JOINT_STATE
    for kind, option in ((JOINT_STATE, '--joint-states'), (ENCODER_PULSE, '--pulses')):
        found = _topics_of(source, kind)
        if len(found) > 1:
            listed = ', '.join(found)
            raise ConfigError(f'{path}: {len(found)} topics of {kind}: {listed}; expected one, or a choice by {option}')
        if found:
            return found[0], kind
    listed = ', '.join(sorted(source.topics))
    raise ConfigError(f'{path}: no topic of {JOINT_STATE}, nor of {ENCODER_PULSE}; it has {listed}')


def _given_topic(path: Path, source: BagSource, topic: str, kind: str, option: str) -> str:
    if source.topics.get(topic) == kind:
        return topic
    found = f'of {source.topics[topic]}' if topic in source.topics else 'not there'
    listed = ', '.join(_topics_of(source, kind)) or 'it has none'
    raise ConfigError(f'{path}: {option}: given {topic}, which is {found}; allowed: a topic of {kind}: {listed}')


def _topics_of(source: BagSource, kind: str) -> List[str]:
    # The encoders' speeds are a JointState without angles.
    return sorted(topic for topic, other in source.topics.items() if other == kind and topic != ENCODER_VELOCITY)


def _joints(
    path: Path, source: BagSource, topic: str, kind: str, options: WheelOptions, params: EncoderParams
) -> Tuple[str, str]:
    names = _names(source, topic, kind)
    if not names:
        raise ConfigError(f'{path}: no message on {topic}; expected {kind}')
    left = _joint(path, topic, names, 'left', options.left_joint, params.left_joint)
    right = _joint(path, topic, names, 'right', options.right_joint, params.right_joint)
    if left == right:
        raise ConfigError(f'{path}: {topic}: given {left} for both wheels; allowed: two of {", ".join(names)}')
    return left, right


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
    """Reads the topic that `find_wheels` has found."""

    def __init__(
        self, wheels: WheelTopic, is_cdr: bool, odometry: OdometryParams, about: str = '', notes: Sequence[str] = ()
    ) -> None:
        """Prepare to read.

        Args:
            wheels: where the angles or counts are.
            is_cdr: of ROS 2.
            odometry: which could be fed with recorded counts; ignored for angles.
            about: how the counts are read, for the reader.
            notes: what the counts cannot show.
        """
        self.topics: Tuple[str, ...] = (wheels.topic,)
        self.joints, self.ppr = wheels.joints, wheels.ppr
        self.text = f'messages of {wheels.topic} ({", ".join(wheels.joints)}{about and f"; {about}"})'
        self.are_joint_angles = wheels.ppr is None
        self._notes = notes
        self._decoder = JointDecoder(wheels.message_type, is_cdr)
        self._counted = None if self.are_joint_angles else CountedAngles(wheels.joints, odometry)

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return the joints of one message.

        Raises:
            InputFault: the message is torn, or has not the counts of both wheels.
        """
        joints = self._decoder.decode(message.raw)
        return (joints if self._counted is None else self._counted.angles(joints),)

    def notes(self) -> Iterator[str]:
        """List what the counts cannot show, and how often their counters restarted."""
        yield from self._notes
        if self._counted and self._counted.restarts:
            yield (
                f'{self.topics[0]}: counter restarts: {self._counted.restarts}; what the wheels turned meanwhile is '
                f'lost. Counters that wrap elsewhere than at their counter_modulus look like that, too'
            )
