"""The message types of a trial's bag and their definitions, by rosbags."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.serialization.message_types import DEFINITIONS

STORE = get_typestore(Stores.ROS1_NOETIC)
for _name, _fields in DEFINITIONS.items():
    STORE.register(get_types_from_msg(_fields, _name))


class Definition(NamedTuple):
    """What a bag contains about a type."""

    text: str  # its fields and those of the types it is made of, without comments
    md5sum: str

    @property
    def has_header(self) -> bool:
        """Whether the first field is a Header, whose seq the publisher counts."""
        return self.text.startswith('std_msgs/Header header\n')


@lru_cache(maxsize=None)
def definition(message_type: str) -> Definition:
    """Return the definition of a type by its name as rosbags spells it."""
    return Definition(*STORE.generate_msgdef(message_type))
