"""Wheel angles from any two numbers in the messages of a bag: which numbers it has, and reading them."""

from __future__ import annotations

import contextlib
import math
import re
import shlex
from array import array
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.number_units import TICKS
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.topics import ARROW, ODOMETRY_TYPE, TF, TRANSFORMS_TYPE
from diff_encoder_sim.drives.wheel_source import (
    LONGEST_GAP_NS,
    TimedDrive,
    WheelNumbers,
    WheelUnit,
    paired_drives,
    receive_times_note,
    wheel_angles,
)
from diff_encoder_sim.drives.wire import TORN
from diff_encoder_sim.wheels.encoder_params import PerWheel

# By type: constants, and fields as name and what it is, as rosbags has them.
Fields = Dict[str, Tuple[Any, Any]]


class MessageType(NamedTuple):
    """A type of messages, decoded by rosbags."""

    name: str
    store: Any  # rosbags' Typestore
    is_cdr: bool

    @property
    def fields(self) -> Fields:
        """Fields of this type and of those that it is made of."""
        fields: Fields = getattr(self.store, 'fielddefs', None) or self.store.FIELDDEFS  # of rosbags for Python 3.8
        return fields

    def decode(self, raw: bytes) -> Any:
        """Decode a message.

        Raises:
            InputFault: it is torn, or of another type.
        """
        decode = self.store.deserialize_cdr if self.is_cdr else self.store.deserialize_ros1
        try:
            return decode(raw, self.name)
        except Exception:  # rosbags raises many types for a torn message
            raise InputFault(TORN) from None


def message_type(path: Path, source: BagSource, topic: str) -> MessageType:
    """Return the type of a topic.

    Raises:
        ConfigError: neither the bag nor ROS defines it.
    """
    name = source.topics[topic]
    found = MessageType(name, _store(name, source.definitions.get(name, ''), source.is_cdr), source.is_cdr)
    if name not in found.fields:
        raise ConfigError(f'{path}: {topic} is of {name}, which the bag does not define; expected a bag that does')
    return found


def _store(name: str, definition: str, is_cdr: bool) -> Any:
    """Return the types of a definition; those of ROS if it is damaged or missing."""
    with contextlib.suppress(Exception):  # rosbags raises many types for a damaged text
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition, name))
        store.get_msgdef(name)  # fails if a type is missing that it is made of
        return store
    return get_typestore(Stores.ROS2_HUMBLE if is_cdr else Stores.ROS1_NOETIC)


# Of std_msgs, and of others like them: the field that is meant where none is named.
USUAL_FIELD = 'data'
HEADER = 'std_msgs/msg/Header'

_ADDRESS = re.compile(r'(?P<topic>[^.\[\]\s]+)(?P<path>(?:\.\w+|\[[0-9]{1,9}\])*)')
_STEP = re.compile(r'\.(\w+)|\[([0-9]+)\]')
_BITS = {'int8': 8, 'uint8': 8, 'byte': 8, 'char': 8, 'octet': 8, 'int16': 16, 'uint16': 16, 'int32': 32, 'uint32': 32}
_NUMBERS = (*_BITS, 'int64', 'uint64', 'float32', 'float64')
# How many elements of an array are listed, and how deep messages in messages.
_LISTED_ELEMENTS, _LISTED_DEPTH = 4, 4

Steps = Tuple[Union[str, int], ...]


class MessageField(NamedTuple):
    """Where a number is."""

    topic: str
    steps: Steps  # names of fields, and indices
    number: str  # its type, as ROS spells it
    message: MessageType

    @property
    def name(self) -> str:
        """As users write it."""
        steps = self.steps[1:] if self.steps[0] == USUAL_FIELD else self.steps
        return self.topic + ''.join(f'[{step}]' if isinstance(step, int) else f'.{step}' for step in steps)

    @property
    def bits(self) -> Optional[int]:
        """Width of a whole number after which its counter wraps; None where it does not."""
        return _BITS.get(self.number)

    @property
    def has_header(self) -> bool:
        """Whether messages have a stamp."""
        return ('header', HEADER) in [(name, what[1]) for name, what in self.message.fields[self.message.name][1]]

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
        # A whole number of numpy's would wrap in what follows.
        return float(decoded) if self.number.startswith('float') else int(decoded)


def find_field(path: Path, source: BagSource, option: str, given: str) -> MessageField:
    """Find what a user has named.

    Raises:
        ConfigError: there is no such topic, or no such number in its messages; it lists those that are there.
    """
    match = _ADDRESS.fullmatch(given)
    topic = match['topic'] if match else ''
    topic = topic if topic in source.topics else f'/{topic}'
    if not match or topic not in source.topics:
        listed = ', '.join(sorted(source.topics))
        raise ConfigError(f'{path}: {option}: given {given}; allowed: TOPIC or TOPIC.field[0] of its topics {listed}')
    message = message_type(path, source, topic)
    steps = [int(index) if index else name for name, index in _STEP.findall(match['path'])]
    if (not steps or isinstance(steps[0], int)) and USUAL_FIELD in _names(message.fields, message.name):
        steps.insert(0, USUAL_FIELD)
    number = _number_at(message.fields, (Nodetype.NAME, message.name), steps)
    if number is None:
        listed = ', '.join(topic + text for text in number_paths(message.fields, message.name)) or 'it has no numbers'
        raise ConfigError(f'{path}: {option}: given {given}, which is no number of {message.name}; allowed: {listed}')
    return MessageField(topic, tuple(steps), number, message)


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
        for index in range(min(size or 2, _LISTED_ELEMENTS)):  # of a sequence nobody knows how many it has
            yield from (f'[{index}]{text}' for text in _paths_of(fields, element, depth))


def _number_at(fields: Fields, what: Any, steps: List[Union[str, int]]) -> Optional[str]:
    """Return the type of the number at the end of the steps; None where there is none."""
    for step in steps:
        kind, about = what
        if isinstance(step, int):
            if kind not in (Nodetype.ARRAY, Nodetype.SEQUENCE) or (kind == Nodetype.ARRAY and step >= about[1]):
                return None
            what = about[0]
        elif kind == Nodetype.NAME and step in _names(fields, about):
            what = dict(fields[about][1])[step]
        else:
            return None
    kind, about = what
    return str(about[0]) if kind == Nodetype.BASE and about[0] in _NUMBERS else None


def _names(fields: Fields, message: str) -> List[str]:
    return [name for name, _ in fields[message][1]] if message in fields else []


# What a bag without wheel angles has that could serve instead, as options to type.
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
# Elements of an array are both wheels only where its name is about wheels.
_OF_WHEELS = re.compile('tick|enc|count|wheel|drive|motor')
# By the first of these in a name, the unit that it is likely in; empty where it is about no turning of wheels.
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


class _Pair(NamedTuple):
    left: str
    right: str
    unit: str

    @property
    def option(self) -> str:
        about = '--ticks-per-revolution N' if self.unit == TICKS else f'--unit {self.unit}'
        return f'--ticks {shlex.quote(self.left)} {shlex.quote(self.right)} {about}'


def serving_options(path: Path, source: BagSource) -> List[str]:
    """List options by which wheel angles can be had from a bag, the likeliest first."""
    pairs = sorted(_pairs(path, source), key=lambda pair: ([TICKS, 'rad', 'm', 'rad/s', 'rpm'].index(pair.unit), pair))
    poses = sorted(topic for topic, kind in source.topics.items() if kind == ODOMETRY_TYPE)
    if not poses and source.topics.get(TF) == TRANSFORMS_TYPE:
        poses = [shlex.quote(f'odom{ARROW}base_link')]
    return [*(pair.option for pair in pairs[:_LISTED_OPTIONS]), *(f'--odom {each}' for each in poses[:_LISTED_OPTIONS])]


def _pairs(path: Path, source: BagSource) -> Iterator[_Pair]:
    names = dict.fromkeys(_numbers(path, source))
    for left in names:
        right = _mirrored(left, names)
        unit = _unit(left)
        if right and unit:
            yield _Pair(left, right, unit)


def _numbers(path: Path, source: BagSource) -> Iterator[str]:
    """List all numbers in the messages of a bag, as users name them."""
    for topic in source.topics:
        with contextlib.suppress(ConfigError):  # of a type that nobody defines
            found = message_type(path, source, topic)
            for text in number_paths(found.fields, found.name):
                yield topic if text == '.data' else topic + text


def _mirrored(left: str, names: Dict[str, None]) -> str:
    words_in_it = [
        words for words in _MIRRORED if words[0] in left and (words[0] != '[0]' or _OF_WHEELS.search(left.lower()))
    ]
    candidates = (left.replace(*words) for words in words_in_it)
    return next((right for right in candidates if right in names), '')


def _unit(name: str) -> str:
    return next((unit for words, unit in _UNITS_BY_WORD if re.search(words, name.lower())), '')


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
