"""One number in the messages of a topic, named as TOPIC.field.field[0]."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, Iterator, List, NamedTuple, Optional, Tuple, Union

from rosbags.interfaces import Nodetype

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.bag_types import Fields, MessageType, message_type

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
