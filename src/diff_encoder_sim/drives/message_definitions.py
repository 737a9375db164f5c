"""The original definitions of the recorded message types, with their comments, as a node's publisher sends them.

ROS's tools compare these texts: where they differ, `rosbag check` sees another version of the message. The files of
definitions/ are those of the packages, so that bags are the same where ROS is not installed.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Iterator, List

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
