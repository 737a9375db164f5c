"""The message types of a trial's bag and their definitions; what is computed of them, rosbags computes."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from diff_encoder_sim.drives.message_definitions import defined_types, fields_text, full_text


@lru_cache(maxsize=None)
def noetic_store() -> Typestore:
    """Return all message types of ROS 1 Noetic that rosbags has, and those of a trial's bag."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in defined_types():
        if name not in store.types:
            store.register(get_types_from_msg(fields_text(name), name))
    return store


class Definition(NamedTuple):
    """What a bag contains about a type."""

    text: str  # its .msg file and those of the types it is made of
    md5sum: str
    has_header: bool  # whether the first field is a Header, whose seq the publisher counts


@lru_cache(maxsize=None)
def definition(message_type: str) -> Definition:
    """Return the definition of a type by its name as rosbags spells it."""
    fields, md5sum = noetic_store().generate_msgdef(message_type)
    return Definition(full_text(message_type), md5sum, fields.startswith('std_msgs/Header header\n'))
