"""The message types of a bag: those that it defines itself, and ROS's own."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path
from typing import Any, Dict, NamedTuple, Tuple

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.recording.bag_source import BagSource
from diff_encoder_sim.serialization.field_reader import TORN

# What rosbags raises where bytes of a definition or a message have changed.
DAMAGE = (OSError, RuntimeError, ValueError, LookupError, AssertionError, struct.error, MemoryError)

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
        except (SerdeError, TypesysError, *DAMAGE):
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
    with contextlib.suppress(TypesysError, *DAMAGE):
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition, name))
        store.get_msgdef(name)  # fails where a type is missing that it is made of
        if definition:
            return store
    return get_typestore(Stores.ROS2_HUMBLE if is_cdr else Stores.ROS1_NOETIC)
