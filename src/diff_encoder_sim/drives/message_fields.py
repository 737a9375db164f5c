"""The message types of a bag, those that it defines itself and ROS's own, and numbers in their messages."""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.wire import TORN

# Of a definition: rosbags makes code for each element of an array of fixed size, and a text may define many types.
LARGEST_TYPE = 5000  # fields and elements, over all levels; an array of numbers is one
LONGEST_DEFINITION = 1 << 18  # characters

# By type: constants, and fields as name and what it is, as rosbags has them.
Fields = Dict[str, Tuple[Any, Any]]


class _Extent(NamedTuple):
    fields: float  # and elements of arrays, over all levels
    takes_bytes: bool  # in a message


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
        ConfigError: neither the bag nor ROS defines it, or its definition is too large.
    """
    name = source.topics[topic]
    try:
        found = MessageType(name, _store(name, source.definitions.get(name, ''), source.is_cdr), source.is_cdr)
    except InputFault as fault:
        raise ConfigError(f'{path}: {topic}: definition of {name}: {fault}') from None
    if name not in found.fields:
        raise ConfigError(f'{path}: {topic} is of {name}, which the bag does not define; expected a bag that does')
    return found


def _store(name: str, definition: str, is_cdr: bool) -> Any:
    if len(definition) > LONGEST_DEFINITION:
        raise InputFault(f'given {len(definition)} characters; allowed: at most {LONGEST_DEFINITION}')
    types: Fields = {}
    with contextlib.suppress(Exception):  # of many types, if the text is damaged
        types = get_types_from_msg(definition, name)
    try:
        count = _extent(types, name, {}).fields
    except RecursionError:
        count = math.inf
    if count > LARGEST_TYPE:
        raise InputFault(f'given more fields and elements of arrays than allowed: at most {LARGEST_TYPE}')
    with contextlib.suppress(Exception):
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        store.get_msgdef(name)  # fails if a type is missing that it is made of
        return store
    return get_typestore(Stores.ROS2_HUMBLE if is_cdr else Stores.ROS1_NOETIC)


def _extent(types: Fields, name: str, known: Dict[str, _Extent]) -> _Extent:
    """Measure a type; one that contains itself is infinite, one that is not defined here is ROS's own."""
    if name not in known:
        known[name] = _Extent(math.inf, True)
        parts = [_field_extent(types, what, known) for _, what in (types[name][1] if name in types else ())]
        takes_bytes = name not in types or any(part.takes_bytes for part in parts)
        known[name] = _Extent(sum(part.fields for part in parts), takes_bytes)
    return known[name]


def _field_extent(types: Fields, what: Any, known: Dict[str, _Extent]) -> _Extent:
    kind, about = what
    if kind == Nodetype.BASE:
        return _Extent(1, True)
    if kind == Nodetype.NAME:
        named = _extent(types, about, known)
        return _Extent(1 + named.fields, named.takes_bytes)
    (element_kind, element_about), length = about
    element = _field_extent(types, about[0], known)
    if kind == Nodetype.SEQUENCE:  # a message could have any number of elements that take no bytes
        return _Extent(1 + element.fields if element.takes_bytes else math.inf, True)
    is_of_numbers = element_kind == Nodetype.BASE and element_about[0] != 'string'
    return _Extent(1 + element.fields * (1 if is_of_numbers else length), element.takes_bytes and length > 0)


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
