"""Streams the messages of a recorded drive from any kind of bag."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Collection, Iterator, Union

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.serialization.ros1_stream import MAGIC, Message, Ros1Stream


class Ros2Stream:
    """A ROS 2 bag, sqlite3 or mcap, as rosbags reads it."""

    is_cdr = True

    def __init__(self, reader: AnyReader) -> None:
        self._reader = reader
        self.topics = {connection.topic: connection.msgtype for connection in reader.connections}
        self.definitions = {connection.msgtype: _definition(connection) for connection in reader.connections}
        self.fault = ''

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of their recording, as far as they can be read."""
        connections = [connection for connection in self._reader.connections if connection.topic in topics]
        if not connections:
            return
        try:
            for connection, time_ns, raw in self._reader.messages(connections):
                yield Message(connection.topic, time_ns, bytes(raw))
        except Exception as error:  # each storage raises its own, some from libraries that rosbags uses
            self.fault = f'damaged: {in_one_line(error)}'


def _definition(connection: Connection) -> str:
    """Return a type's definition as it was recorded, empty where it was not."""
    recorded = connection.msgdef
    return str(getattr(recorded, 'data', recorded))  # a text itself in rosbags for Python 3.8


BagSource = Union[Ros1Stream, Ros2Stream]


@contextlib.contextmanager
def open_source(path: Path) -> Iterator[BagSource]:
    """Open a bag to stream from: a file of ROS 1, or a file or folder of ROS 2.

    Raises:
        ConfigError: it is missing, cannot be read, or has no message.
    """
    if not path.exists():
        raise ConfigError(f'{path}: no such bag')
    if path.is_file() and _beginning(path) == MAGIC:
        yield _not_empty(path, Ros1Stream(path))
        return
    with contextlib.ExitStack() as opened:
        try:
            # Older recorders leave the definitions out, and they are not used here.
            reader = opened.enter_context(AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)))
        except Exception as error:  # as for messages; MemoryError, too, where sizes are damaged
            expected = 'expected a file of ROS 1, or a folder, .db3 or .mcap of ROS 2'
            raise ConfigError(f'{path}: not a readable bag: {in_one_line(error)}; {expected}') from None
        yield _not_empty(path, Ros2Stream(reader))


def _beginning(path: Path) -> bytes:
    try:
        with open(path, 'rb') as file:
            return file.read(len(MAGIC))
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None


def _not_empty(path: Path, source: BagSource) -> BagSource:
    if not source.topics:
        raise ConfigError(f'{path}: no message in it{source.fault and f" ({source.fault})"}')
    return source
