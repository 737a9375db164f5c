"""Which topic of a bag tells how far the wheels have turned, and under which names."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.encoders.counter import count_difference
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.recording.bag_source import BagSource
from diff_encoder_sim.serialization.joint_messages import JointDecoder, JointValues
from diff_encoder_sim.serialization.message_types import ENCODER_PULSE, JOINT_STATE

# Joints may come in several messages in turn, so more than the first tells their names.
MESSAGES_LOOKED_AT = 500

_SIDES = {'left': {'left', 'l'}, 'right': {'right', 'r'}}


class WheelTopic(NamedTuple):
    """Where the wheels' angles come from."""

    topic: str
    message_type: str  # JOINT_STATE or ENCODER_PULSE
    joints: Tuple[str, str]  # left, right
    ppr: Optional[PerWheel]  # of counts


class WheelOptions(NamedTuple):
    """What the user says of it; empty where the bag is to tell."""

    joint_states: str = ''
    pulses: str = ''
    pulses_ppr: Optional[PerWheel] = None
    left_joint: str = ''
    right_joint: str = ''


def find_wheels(path: Path, source: BagSource, options: WheelOptions, params: EncoderParams) -> WheelTopic:
    """The topic and the joints to read.

    Args:
        path: of the bag, for messages.
        source: the bag.
        options: what is chosen already.
        params: of the robot, whose joints are taken where the bag has them.

    Raises:
        ConfigError: there is none, or a choice to make; it lists what there is.
    """
    topic, kind = _topic(path, source, options)
    names = _names(source, topic, kind)
    if not names:
        raise ConfigError(f'{path}: no message on {topic}; expected {kind}')
    joints = (
        _joint(path, topic, names, 'left', options.left_joint, params.left_joint),
        _joint(path, topic, names, 'right', options.right_joint, params.right_joint),
    )
    if joints[0] == joints[1]:
        raise ConfigError(f'{path}: {topic}: given {joints[0]} for both wheels; allowed: two of {", ".join(names)}')
    if kind == ENCODER_PULSE and options.pulses_ppr is None:
        raise ConfigError(
            f'{path}: {topic} has counts; expected --pulses-ppr, the pulses per revolution of their encoder'
        )
    return WheelTopic(topic, kind, joints, options.pulses_ppr if kind == ENCODER_PULSE else None)


def _topic(path: Path, source: BagSource, options: WheelOptions) -> Tuple[str, str]:
    if options.joint_states and options.pulses:
        raise ConfigError('--joint-states, --pulses: given both; allowed: one of them')
    if options.pulses:
        return _given_topic(path, source, options.pulses, ENCODER_PULSE, '--pulses'), ENCODER_PULSE
    if options.joint_states:
        return (_given_topic(path, source, options.joint_states, JOINT_STATE, '--joint-states'), JOINT_STATE)
    for kind, option in ((JOINT_STATE, '--joint-states'), (ENCODER_PULSE, '--pulses')):
        found = _topics_of(source, kind)
        if len(found) > 1:
            raise ConfigError(
                f'{path}: {len(found)} topics of {kind}: {", ".join(found)}; expected one, or a choice by {option}'
            )
        if found:
            return found[0], kind
    raise ConfigError(
        f'{path}: no topic of {JOINT_STATE}, nor of {ENCODER_PULSE}; it has {", ".join(sorted(source.topics))}'
    )


def _given_topic(path: Path, source: BagSource, topic: str, kind: str, option: str) -> str:
    if source.topics.get(topic) == kind:
        return topic
    there = source.topics.get(topic)
    raise ConfigError(
        f'{path}: {option}: given {topic}, which is '
        f'{"of " + there if there else "not there"}; allowed: a topic of {kind}: '
        f'{", ".join(_topics_of(source, kind)) or "it has none"}'
    )


def _topics_of(source: BagSource, kind: str) -> List[str]:
    return sorted(topic for topic, other in source.topics.items() if other == kind)


def _names(source: BagSource, topic: str, kind: str) -> List[str]:
    """Of joints, in the order of their appearance."""
    decoder = JointDecoder(kind, source.is_cdr)
    names: Dict[str, None] = {}
    for message in itertools.islice(source.messages((topic,)), MESSAGES_LOOKED_AT):
        try:
            names.update(dict.fromkeys(decoder.decode(message.raw).names))
        except InputFault:
            continue  # counted when the drive is read
    return list(names)


def _joint(path: Path, topic: str, names: Sequence[str], side: str, given: str, usual: str) -> str:
    """Of one side: as given, else the robot's, else the only wheel that is called so."""
    if given or usual in names:
        if (given or usual) in names:
            return given or usual
        raise ConfigError(f'{path}: {topic}: --{side}: given {given!r}; allowed: {", ".join(names)}')
    wheels = [name for name in names if 'wheel' in name.lower()]
    found = [name for name in wheels if _SIDES[side] & set(re.split('[^a-z]+', name.lower()))]
    if len(wheels) != 2 or len(found) != 1:
        raise ConfigError(f'{path}: {topic}: no joint {usual!r}; expected --{side}, one of {", ".join(names)}')
    return found[0]


class CountedAngles:
    """Wheel angles from the counts of an encoder: the middle of the pulse that the wheel is in.

    At a PPR that divides this encoder's, equation (1) then gives the very counts. At another PPR,
    a count is one off in a quarter of PPR / this encoder's PPR of the samples.
    """

    def __init__(self, wheels: WheelTopic, counter_modulus: int) -> None:
        """`wheels` are those of a topic of counts, which wrap at `counter_modulus` unless 0."""
        self._rad_per_pulse = {
            joint: 2.0 * math.pi / ppr for joint, ppr in zip(wheels.joints, (wheels.ppr.left, wheels.ppr.right))
        }
        self._modulus = counter_modulus
        self._shown: Dict[str, int] = {}  # by joint: the count that came last
        self._totals: Dict[str, int] = {}  # by joint: unwrapped

    def angles(self, counts: JointValues) -> JointValues:
        """The message with angles [rad] for counts, and without joints that are no wheels."""
        wheels = [
            (joint, int(count)) for joint, count in zip(counts.names, counts.values) if joint in self._rad_per_pulse
        ]
        return counts._replace(
            names=tuple(joint for joint, _ in wheels), values=[self._angle_rad(*wheel) for wheel in wheels]
        )

    def _angle_rad(self, joint: str, count: int) -> float:
        shown = self._shown.get(joint)
        self._totals[joint] = (
            count if shown is None else self._totals[joint] + count_difference(count, shown, self._modulus)
        )
        self._shown[joint] = count
        return (self._totals[joint] + 0.5) * self._rad_per_pulse[joint]
