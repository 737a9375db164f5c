"""The recorded message types as ROS 2 has them: their definitions, and messages in its encoding, CDR. By rosbags."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.field_reader import TORN
from diff_encoder_sim.drives.message_definitions import defined_types, fields_text


class Ros2Definition(NamedTuple):
    """What a ROS 2 bag contains about a type."""

    text: str  # its fields and those of the types it is made of
    type_hash: str  # RIHS01, of REP 2016


@lru_cache(maxsize=None)
def ros2_definition(message_type: str) -> Ros2Definition:
    """Return the definition of a type by its name as rosbags, and ROS 2, spell it."""
    store = _ros2_store()
    return Ros2Definition(store.generate_msgdef(message_type, ros_version=2)[0], store.hash_rihs01(message_type))


def to_cdr(message: bytes, message_type: str) -> bytes:
    """Return a message that is encoded for ROS 1 in CDR; a header loses its seq, which ROS 2 has not."""
    return bytes(_ros2_store().ros1_to_cdr(message, message_type))


def to_ros1(message: bytes, message_type: str) -> bytes:
    """Return a message in CDR encoded for ROS 1; the seq of a header is 0.

    Raises:
        InputFault: the message is torn, or in a foreign byte order.
    """
    try:
        return bytes(_ros2_store().cdr_to_ros1(message, message_type))
    except Exception:  # rosbags raises many types for a torn message
        raise InputFault(TORN) from None


@lru_cache(maxsize=None)
def _ros2_store() -> Any:
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name in defined_types():
        if name not in store.types:
            store.register(get_types_from_msg(fields_text(name), name))
    return store
