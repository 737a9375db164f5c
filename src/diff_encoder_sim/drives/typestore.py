"""The message types of a trial's bag and their definitions; what is computed of them, rosbags computes."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Iterator, List, NamedTuple

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.wire import TORN

FOLDER = Path(__file__).parent / 'definitions'

_SEPARATOR = 80 * '='
_HEADER = 'std_msgs/Header'
_PRIMITIVES = (
    *('bool', 'byte', 'char', 'string', 'time', 'duration', 'float32', 'float64'),
    *(f'{sign}int{bits}' for sign in ('', 'u') for bits in (8, 16, 32, 64)),
)


def defined_types() -> List[str]:
    """List the types, as rosbags spells them."""
    return sorted(f'{path.parent.name}/msg/{path.stem}' for path in FOLDER.glob('*/*.msg'))


def fields_text(message_type: str) -> str:
    """Return the text of a type's own .msg file; `message_type` is as rosbags spells it."""
    return _file_text(message_type.replace('/msg/', '/'))


@lru_cache(maxsize=None)
def full_text(message_type: str) -> str:
    """Return the text of a type's .msg file and of those of all types it is made of, as `gendeps --cat` joins them."""
    name = message_type.replace('/msg/', '/')
    parts = dict.fromkeys(_parts(name))
    texts = [_file_text(name), *(f'{_SEPARATOR}\nMSG: {part}\n{_file_text(part)}' for part in parts)]
    return '\n'.join(texts)


@lru_cache(maxsize=None)
def _file_text(name: str) -> str:
    return (FOLDER / f'{name}.msg').read_text(encoding='utf-8')


def _parts(name: str) -> Iterator[str]:
    """Find the types that a type is made of, in the order of the fields, each followed by its own parts."""
    for part in dict.fromkeys(_field_types(name)):
        yield part
        yield from _parts(part)


def _field_types(name: str) -> Iterator[str]:
    """Find the types of a message's fields that are messages themselves."""
    for line in _file_text(name).splitlines():
        words = line.partition('#')[0].split()
        kind = words[0].partition('[')[0] if words else ''
        if not kind or '=' in line.partition('#')[0] or kind in _PRIMITIVES:
            continue  # nothing, a constant, or a number or text
        if kind == 'Header':
            yield _HEADER
        else:
            yield kind if '/' in kind else f'{name.partition("/")[0]}/{kind}'


@lru_cache(maxsize=None)
def _store(of_ros: Stores) -> Any:
    """Return the message types that rosbags has of a version of ROS, and those of a trial's bag."""
    store = get_typestore(of_ros)
    for name in defined_types():
        if name not in store.types:
            store.register(get_types_from_msg(fields_text(name), name))
    return store


def noetic_store() -> Typestore:
    """Return all message types of ROS 1 Noetic that rosbags has, and those of a trial's bag."""
    store: Typestore = _store(Stores.ROS1_NOETIC)
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


class Ros2Definition(NamedTuple):
    """What a ROS 2 bag contains about a type."""

    text: str  # its fields and those of the types it is made of
    type_hash: str  # RIHS01, of REP 2016


@lru_cache(maxsize=None)
def ros2_definition(message_type: str) -> Ros2Definition:
    """Return the definition of a type by its name as rosbags, and ROS 2, spell it."""
    store = _store(Stores.ROS2_HUMBLE)
    return Ros2Definition(store.generate_msgdef(message_type, ros_version=2)[0], store.hash_rihs01(message_type))


def to_cdr(message: bytes, message_type: str) -> bytes:
    """Return a message that is encoded for ROS 1 in CDR; a header loses its seq, which ROS 2 has not."""
    return bytes(_store(Stores.ROS2_HUMBLE).ros1_to_cdr(message, message_type))


def to_ros1(message: bytes, message_type: str) -> bytes:
    """Return a message in CDR encoded for ROS 1; the seq of a header is 0.

    Raises:
        InputFault: the message is torn, or in a foreign byte order.
    """
    try:
        return bytes(_store(Stores.ROS2_HUMBLE).cdr_to_ros1(message, message_type))
    except Exception:  # rosbags raises many types for a torn message
        raise InputFault(TORN) from None
