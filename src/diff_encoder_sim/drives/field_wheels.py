"""Wheel angles from any two numbers in the messages of a bag: listing these numbers, and reading them."""

from __future__ import annotations

import contextlib
import math
import re
import shlex
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.message_decoders import TORN
from diff_encoder_sim.drives.number_units import TICKS
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.topics import ARROW, ODOMETRY_TYPE, TF, TRANSFORMS_TYPE
from diff_encoder_sim.drives.wheel_source import WheelSeries, WheelSource, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel

# By type: constants, and fields with their types, as rosbags has them.
Fields = Dict[str, Tuple[Any, Any]]

# Of std_msgs, and of others like them: the field that is meant if none is named.
USUAL_FIELD = 'data'
HEADER = 'std_msgs/msg/Header'

_ADDRESS = re.compile(r'(?P<topic>[^.\[\]\s]+)(?P<path>(?:\.\w+|\[[0-9]{1,9}\])*)')
_STEP = re.compile(r'\.(\w+)|\[([0-9]+)\]')
_BITS = {'int8': 8, 'uint8': 8, 'byte': 8, 'char': 8, 'octet': 8, 'int16': 16, 'uint16': 16, 'int32': 32, 'uint32': 32}
_NUMBERS = (*_BITS, 'int64', 'uint64', 'float32', 'float64')
# Listed elements of an array, and depth of messages in messages.
_LISTED_ELEMENTS, _LISTED_DEPTH = 4, 4


class MessageField(NamedTuple):
    """The place of a number."""

    topic: str
    message_type: str
    steps: Tuple[Union[str, int], ...]  # names of fields, and indices
    number: str  # its type, as ROS spells it
    store: Any  # rosbags' Typestore
    is_cdr: bool

    @property
    def name(self) -> str:
        """As users write it."""
        steps = self.steps[1:] if self.steps[0] == USUAL_FIELD else self.steps
        return self.topic + ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in steps)

    @property
    def bits(self) -> Optional[int]:
        """Width of a whole number after which its counter wraps; None if it does not."""
        return _BITS.get(self.number)

    @property
    def has_header(self) -> bool:
        """Whether messages have a stamp."""
        return ('header', HEADER) in [(name, what[1]) for name, what in _fields_of(self.store)[self.message_type][1]]

    def decode(self, raw: bytes) -> Any:
        """Decode a message.

        Raises:
            InputFault: it is torn, or of another type.
        """
        decode = self.store.deserialize_cdr if self.is_cdr else self.store.deserialize_ros1
        try:
            return decode(raw, self.message_type)
        except Exception:  # rosbags raises many types for a torn message
            raise InputFault(TORN) from None

    def value(self, decoded: Any) -> float:
        """Return the number of a decoded message.

        Raises:
            InputFault: there is none, or it is not finite.
        """
        for step in self.steps:
            if isinstance(step, str):
                decoded = getattr(decoded, step)
            elif step < len(decoded):
                decoded = decoded[step]
            else:
                raise InputFault(f'{self.name}: {len(decoded)} elements in the message')
        if not math.isfinite(decoded):
            raise InputFault(f'{self.name} is {decoded}; expected a finite number')
        return float(decoded)


def find_field(path: Path, source: BagSource, option: str, given: str) -> MessageField:
    """Find the number that a user names.

    Raises:
        ConfigError: there is no such topic, or no such number in its messages; it lists the existing ones.
    """
    match = _ADDRESS.fullmatch(given)
    topic = match['topic'] if match else ''
    topic = topic if topic in source.topics else f'/{topic}'
    if not match or topic not in source.topics:
        listed = ', '.join(sorted(source.topics))
        raise ConfigError(f'{path}: {option}: given {given}; allowed: TOPIC or TOPIC.field[0] of its topics {listed}')
    kind, store = source.topics[topic], _store(source, topic)
    fields = _fields_of(store)
    if kind not in fields:
        raise ConfigError(f'{path}: {topic} is of {kind}, which the bag does not define; expected a bag that does')
    steps: List[Union[str, int]] = [int(index) if index else name for name, index in _STEP.findall(match['path'])]
    if (not steps or isinstance(steps[0], int)) and USUAL_FIELD in dict(fields[kind][1]):
        steps.insert(0, USUAL_FIELD)
    number = _number_at(fields, (Nodetype.NAME, kind), steps)
    if number is None:
        listed = ', '.join(topic + text for text in number_paths(fields, kind)) or 'it has no numbers'
        raise ConfigError(f'{path}: {option}: given {given}, which is no number of {kind}; allowed: {listed}')
    return MessageField(topic, kind, tuple(steps), number, store, source.is_cdr)


def _store(source: BagSource, topic: str) -> Any:
    """Return the types of a topic's definition; those of ROS if it is damaged or missing."""
    name = source.topics[topic]
    with contextlib.suppress(Exception):  # rosbags raises many types for a damaged text
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(source.definitions.get(name, ''), name))
        store.get_msgdef(name)  # fails if a type is missing that it is made of
        return store
    return get_typestore(Stores.ROS2_HUMBLE if source.is_cdr else Stores.ROS1_NOETIC)


def _fields_of(store: Any) -> Fields:
    fields: Fields = getattr(store, 'fielddefs', None) or store.FIELDDEFS  # of rosbags for Python 3.8
    return fields


def number_paths(fields: Fields, message: str, depth: int = _LISTED_DEPTH) -> Iterator[str]:
    """List the numbers of a message as users name them after its topic, without those of headers."""
    for name, what in fields[message][1] if depth and message in fields else ():
        if what[1] != HEADER:
            for text in _paths_of(fields, what, depth):
                yield text if (name, text[:1]) == (USUAL_FIELD, '[') else f'.{name}{text}'


def _paths_of(fields: Fields, what: Any, depth: int) -> Iterator[str]:
    kind, about = what
    if kind == Nodetype.BASE:
        yield from [''] if about[0] in _NUMBERS else []
    elif kind == Nodetype.NAME:
        yield from number_paths(fields, about, depth - 1)
    else:
        element, size = about
        for index in range(min(size or 2, _LISTED_ELEMENTS)):  # the length of a sequence is not known
            yield from (f'[{index}]{text}' for text in _paths_of(fields, element, depth))


def _number_at(fields: Fields, what: Any, steps: Sequence[Union[str, int]]) -> Optional[str]:
    """Return the type of the number at the end of the steps; None if there is none."""
    for step in steps:
        kind, about = what
        if isinstance(step, int):
            if kind not in (Nodetype.ARRAY, Nodetype.SEQUENCE) or (kind == Nodetype.ARRAY and step >= about[1]):
                return None
            what = about[0]
        else:
            names = dict(fields[about][1]) if kind == Nodetype.NAME and about in fields else {}
            if step not in names:
                return None
            what = names[step]
    kind, about = what
    return str(about[0]) if kind == Nodetype.BASE and about[0] in _NUMBERS else None


# Listed alternatives of a bag without wheel angles.
_LISTED_OPTIONS = 5

# A name of the left wheel becomes the right one's by one of these.
_MIRRORED = (
    ('left', 'right'),
    ('Left', 'Right'),
    ('LEFT', 'RIGHT'),
    ('lwheel', 'rwheel'),
    ('l_', 'r_'),
    ('_l', '_r'),
    ('[0]', '[1]'),
)
# Elements of an array are both wheels only if its name is about wheels.
_OF_WHEELS = re.compile('tick|enc|count|wheel|drive|motor')
# The likely unit by the first of these words in a name; empty if it is not about the rotation of wheels.
_UNITS_BY_WORD = (
    (
        'cmd|target|command|setpoint|desired|current|temp|pwm|duty|cliff|bump|drop|layout|time|covariance|imu|scan|resolution',
        '',
    ),
    ('tick|encoder|count|enc_', TICKS),
    ('rpm', 'rpm'),
    ('travel|position|angle', 'rad'),
    ('vel|speed', 'rad/s'),
    ('dist|odo', 'm'),
    ('wheel', TICKS),
)
_UNITS_BY_LIKELIHOOD = (TICKS, 'rad', 'm', 'rad/s', 'rpm')


def serving_options(source: BagSource) -> List[str]:
    """List options that give wheel angles of a bag, the likeliest first."""
    names: List[str] = []  # all numbers, as users name them
    for topic, kind in source.topics.items():
        paths = number_paths(_fields_of(_store(source, topic)), kind)
        names += [topic if text == f'.{USUAL_FIELD}' else topic + text for text in paths]
    pairs = []
    for left in dict.fromkeys(names):
        right = next((right for right in _mirrored(left) if right in names), '')
        unit = next((unit for words, unit in _UNITS_BY_WORD if re.search(words, left.lower())), '')
        if right and unit:
            about = '--ticks-per-revolution N' if unit == TICKS else f'--unit {unit}'
            option = f'--ticks {shlex.quote(left)} {shlex.quote(right)} {about}'
            pairs.append((_UNITS_BY_LIKELIHOOD.index(unit), left, option))
    poses = sorted(topic for topic, kind in source.topics.items() if kind == ODOMETRY_TYPE)
    if not poses and source.topics.get(TF) == TRANSFORMS_TYPE:
        poses = [shlex.quote(f'odom{ARROW}base_link')]
    ticks = [option for _, _, option in sorted(pairs)[:_LISTED_OPTIONS]]
    return [*ticks, *(f'--odom {each}' for each in poses[:_LISTED_OPTIONS])]


def _mirrored(left: str) -> Iterator[str]:
    for left_word, right_word in _MIRRORED:
        if left_word in left and (left_word != '[0]' or _OF_WHEELS.search(left.lower())):
            yield left.replace(left_word, right_word)


class Wheel(NamedTuple):
    """One wheel in a bag."""

    joint: str  # name under which its angles are given
    field: MessageField
    unit: WheelUnit


class FieldWheels(WheelSource):
    """Reads both wheels, from one topic or from two, at the stamps of headers or else the times of receipt."""

    def __init__(
        self, left: Wheel, right: Wheel, ppr: Optional[PerWheel], about: str, notes: Sequence[str] = ()
    ) -> None:
        """Prepare to read.

        Args:
            left: the left wheel.
            right: the right wheel.
            ppr: of counts.
            about: interpretation of the numbers, for the reader.
            notes: limits of the angles.
        """
        self._fields = left.field, right.field
        text = f'messages of {left.field.name}, {right.field.name} ({about})'
        topics = [field.topic for field in self._fields]
        super().__init__(topics, (left.joint, right.joint), text, (left.unit, right.unit), notes)
        self.ppr = ppr
        self._has_stamps = left.field.has_header and right.field.has_header

    def add(self, message: Message) -> None:
        """Add the numbers of a message.

        Raises:
            InputFault: it is torn, or a number is not finite.
        """
        sides = [side for side, field in enumerate(self._fields) if field.topic == message.topic]
        decoded = self._fields[sides[0]].decode(message.raw)
        values = [self._fields[side].value(decoded) for side in sides]
        stamp_ns = message.time_ns
        if self._has_stamps:
            stamp = decoded.header.stamp
            stamp_ns = int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
            if not stamp_ns and message.time_ns >= NANOSECONDS_PER_SECOND:  # a simulation begins at 0
                self._has_stamps, stamp_ns = False, message.time_ns
        for side, value in zip(sides, values):
            self._append(side, stamp_ns, message.time_ns, value)

    def _series(self) -> List[WheelSeries]:
        series = super()._series()
        return series if self._has_stamps else [each._replace(stamps_ns=each.times_ns) for each in series]

    def notes(self) -> Iterator[str]:
        """List stamps that are those of receipt, and limits of the angles."""
        if not self._has_stamps:
            times_ns = {field.topic: of_side.times_ns for field, of_side in zip(self._fields, super()._series())}
            texts = []
            for topic, of_topic in times_ns.items():
                intervals_ms = 1e-6 * np.diff(of_topic) if len(of_topic) > 1 else np.zeros(1)
                texts.append(f'{topic} every {intervals_ms.mean():.1f} ms +- {intervals_ms.std():.1f} ms')
            yield (
                f'no stamps: the times of receipt are used, of {" and ".join(texts)} (mean, standard '
                f'deviation); this jitter is in speeds and comparisons, not in the counts'
            )
        yield from super().notes()
