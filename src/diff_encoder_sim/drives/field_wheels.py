"""Wheel angles from any two numbers in the messages of a bag: listing these numbers, and reading them."""

from __future__ import annotations

import math
import re
import shlex
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import TORN
from diff_encoder_sim.drives.number_units import TICKS
from diff_encoder_sim.drives.topics import ARROW, ODOMETRY_TYPE, TF, TRANSFORMS_TYPE
from diff_encoder_sim.drives.wheel_source import WheelNumbers, WheelSeries, WheelSource

Fields = Dict[str, Tuple[Any, Any]]  # by type: constants, and fields with their types, as rosbags has them
HEADER = 'std_msgs/msg/Header'

_ADDRESS = re.compile(r'(?P<topic>[^.\[\]\s]+)(?P<path>(?:\.\w+|\[[0-9]{1,9}\])*)')
_STEP = re.compile(r'\.(\w+)|\[([0-9]+)\]')
_USUAL = re.compile(r'^\.data(?=\[|$)')  # `data` of std_msgs and of others like them, which users need not name
_BITS = {'int8': 8, 'uint8': 8, 'byte': 8, 'char': 8, 'octet': 8, 'int16': 16, 'uint16': 16, 'int32': 32, 'uint32': 32}
_NUMBERS = (*_BITS, 'int64', 'uint64', 'float32', 'float64')
_LISTED_ELEMENTS, _DEPTH = 4, 5  # of an array; of messages in messages


class MessageField(NamedTuple):
    """The place of a number."""

    topic: str
    name: str  # as users write it
    steps: List[Union[str, int]]  # names of fields, and indices
    bits: Optional[int]  # width of a whole number, after which its counter wraps; None if it does not
    has_header: bool  # its messages have a stamp
    deserialize: Callable[[bytes], Any]

    def decode(self, raw: bytes) -> Any:
        """Decode a message; InputFault if it is torn, or of another type."""
        try:
            return self.deserialize(raw)
        except Exception:  # rosbags raises many types for a torn message
            raise InputFault(TORN) from None

    def value(self, decoded: Any) -> float:
        """Return the number of a decoded message; InputFault if there is none, or it is not finite."""
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


def split_address(given: str) -> Tuple[str, str]:
    """Return the topic and the place, such as `.data[0]`, of an address TOPIC.field[0]; empty if it is not one."""
    match = _ADDRESS.fullmatch(given)
    place = _USUAL.sub('', match['path']) if match else ''
    return (match['topic'] if match else ''), place if place.startswith('.') else f'.data{place}'


def steps_of(place: str) -> List[Union[str, int]]:
    """Return the names of fields, and indices, of a place."""
    return [int(index) if index else name for name, index in _STEP.findall(place)]


def find_field(source: DriveStream, option: str, given: str) -> MessageField:
    """Find the number that a user names; ConfigError with a list of the existing ones if there is none."""
    (topic, place), path = split_address(given), source.path
    topic = topic if topic in source.topics else f'/{topic}'
    if topic not in source.topics:
        listed = ', '.join(sorted(source.topics))
        raise ConfigError(f'{path}: {option}: given {given}; allowed: TOPIC or TOPIC.field[0] of its topics {listed}')
    kind, (store, fields) = source.topics[topic], _types(source, topic)
    if kind not in fields:
        raise ConfigError(f'{path}: {topic} is of {kind}, which the bag does not define; expected a bag that does')
    numbers = dict(numbers_of(fields, kind))
    number = numbers.get(re.sub(r'\[[0-9]+\]', '[0]', place))
    if number is None:
        listed = ', '.join(topic + _USUAL.sub('', each) for each in numbers) or 'it has no numbers'
        raise ConfigError(f'{path}: {option}: given {given}, which is no number of {kind}; allowed: {listed}')
    has_header = ('header', HEADER) in [(name, what[1]) for name, what in fields[kind][1]]
    decode = store.deserialize_cdr if source.is_cdr else store.deserialize_ros1
    name, bits = topic + _USUAL.sub('', place), _BITS.get(number)
    return MessageField(topic, name, steps_of(place), bits, has_header, lambda raw: decode(raw, kind))


def _types(source: DriveStream, topic: str) -> Tuple[Any, Fields]:
    """Return the types of a topic's definition; those of ROS if it is damaged or missing."""
    name, store = source.topics[topic], get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(source.definitions.get(name, ''), name))
        store.get_msgdef(name)  # fails if a type is missing that it is made of
    except Exception:  # rosbags raises many types for a damaged text
        store = get_typestore(Stores.ROS2_HUMBLE if source.is_cdr else Stores.ROS1_NOETIC)
    return store, getattr(store, 'fielddefs', None) or store.FIELDDEFS  # type: ignore[attr-defined]  # on Python 3.8


def numbers_of(fields: Fields, message: str, depth: int = _DEPTH) -> Iterator[Tuple[str, str]]:
    """Yield place and type of the numbers of a message, except those of headers; of an array some elements."""
    for name, (kind, about) in fields[message][1] if depth and message in fields else ():
        element, indices = (kind, about), ['']
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            element, size = about
            indices = [f'[{index}]' for index in range(min(size or 2, _LISTED_ELEMENTS))]
        if element[0] == Nodetype.BASE:
            inner = [('', element[1][0])] if element[1][0] in _NUMBERS else []
        else:
            inner = [] if element[1] == HEADER else list(numbers_of(fields, element[1], depth - 1))
        yield from ((f'.{name}{index}{place}', number) for index in indices for place, number in inner)


_LISTED_OPTIONS = 5  # alternatives of a bag without wheel angles
# A name of the left wheel becomes the right one's by one of these.
_MIRRORED = [names.split() for names in ('left right', 'Left Right', 'LEFT RIGHT', 'lwheel rwheel', 'l_ r_', '_l _r')]
# The first two elements of an array are both wheels only if its name is about wheels.
_OF_WHEELS = re.compile('tick|enc|count|wheel|drive|motor')
# The likely unit by the first of these words in a name; empty if it is not about the rotation of wheels.
_UNITS_BY_WORD = (
    ('cmd|target|command|setpoint|desired|current|temp|pwm|duty', ''),
    ('cliff|bump|drop|layout|time|covariance|imu|scan|resolution', ''),
    ('tick|encoder|count|enc_', TICKS),
    ('rpm', 'rpm'),
    ('travel|position|angle', 'rad'),
    ('vel|speed', 'rad/s'),
    ('dist|odo', 'm'),
    ('wheel', TICKS),
)
_UNITS_BY_LIKELIHOOD = (TICKS, 'rad', 'm', 'rad/s', 'rpm')


def serving_options(source: DriveStream) -> List[str]:
    """List options that give wheel angles of a bag, the likeliest first."""
    names: List[str] = []  # all numbers, as users name them
    for topic, kind in source.topics.items():
        names += [topic + _USUAL.sub('', place) for place, _ in numbers_of(_types(source, topic)[1], kind)]
    pairs = []
    for left in dict.fromkeys(names):
        mirrored = [*_MIRRORED, *([('[0]', '[1]')] if _OF_WHEELS.search(left.lower()) else [])]
        rights = (left.replace(of_left, of_right) for of_left, of_right in mirrored if of_left in left)
        right = next((right for right in rights if right in names), '')
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


class FieldWheels(WheelSource):
    """Reads both wheels, from one topic or from two, at the stamps of headers or else the times of receipt."""

    def __init__(self, fields: Sequence[MessageField], joints: Tuple[str, str], numbers: WheelNumbers) -> None:
        """Prepare to read two numbers, left and right."""
        text = f'messages of {fields[0].name}, {fields[1].name} ({numbers.text})'
        super().__init__([field.topic for field in fields], joints, text, numbers)
        self._fields = fields
        self._has_stamps = all(field.has_header for field in fields)

    def add(self, message: Message) -> None:
        """Add the numbers of a message."""
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
            topics = ' and '.join(self.topics)
            yield f'no stamps on {topics}: using the times of receipt; their jitter is in speeds and comparisons'
        yield from super().notes()
