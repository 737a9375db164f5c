"""The message types of a trial's bag and their definitions, with rosbags."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, Tuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.message_decoders import TORN

FOLDER = Path(__file__).parent / 'definitions'


def fields_text(message_type: str) -> str:
    """Return the text of a type's own .msg file; `message_type` is as rosbags spells it."""
    return (FOLDER / f'{message_type.replace("/msg/", "/")}.msg').read_text(encoding='utf-8')


@lru_cache(maxsize=None)
def message_store(of_ros: Stores) -> Typestore:
    """Return all message types of a version of ROS that rosbags has, and those of a trial's bag."""
    store = get_typestore(of_ros)
    for path in sorted(FOLDER.glob('*/*.msg')):
        name = f'{path.parent.name}/msg/{path.stem}'
        if name not in store.types:
            store.register(get_types_from_msg(fields_text(name), name))
    return store


class Definition(NamedTuple):
    """A type as a ROS 1 bag contains it."""

    text: str  # its .msg file and those of the types it is made of
    md5sum: str
    has_header: bool  # whether the first field is a Header, whose seq the publisher counts


@lru_cache(maxsize=None)
def definition(message_type: str) -> Definition:
    """Return the definition of a type, its text as `gendeps --cat` joins it, by its name as rosbags spells it."""
    fields, md5sum = message_store(Stores.ROS1_NOETIC).generate_msgdef(message_type)
    parts = re.findall(r'^MSG: (\S+)$', fields, re.MULTILINE)
    text = '\n'.join([fields_text(message_type), *(f'{80 * "="}\nMSG: {part}\n{fields_text(part)}' for part in parts)])
    return Definition(text, md5sum, fields.startswith('std_msgs/Header header\n'))


@lru_cache(maxsize=None)
def ros2_definition(message_type: str) -> Tuple[str, str]:
    """Return the text of a type and of those it is made of in ROS 2, and its hash RIHS01 of REP 2016."""
    store = message_store(Stores.ROS2_HUMBLE)
    return store.generate_msgdef(message_type, ros_version=2)[0], store.hash_rihs01(message_type)


def to_cdr(message: bytes, message_type: str) -> bytes:
    """Return a ROS 1 message in CDR; a header loses its seq, which ROS 2 does not have."""
    return bytes(message_store(Stores.ROS2_HUMBLE).ros1_to_cdr(message, message_type))


def to_ros1(message: bytes, message_type: str) -> bytes:
    """Return a message in CDR encoded for ROS 1, the seq of a header 0; InputFault if it is torn or big-endian."""
    try:
        return bytes(message_store(Stores.ROS2_HUMBLE).cdr_to_ros1(message, message_type))
    except Exception:  # rosbags raises many types for a torn message
        raise InputFault(TORN) from None
