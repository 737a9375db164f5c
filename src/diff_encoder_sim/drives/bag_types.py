"""The message types of a bag: those that it defines itself, and ROS's own."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any, Dict, NamedTuple, Tuple

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
