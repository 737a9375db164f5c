"""Opens a bag and reads its messages by rosbags, with one line about what is wrong with it."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path
from typing import Iterator, Mapping, Tuple, Union

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.typesys import TypesysError

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.serialization.typestore import definition

# What rosbags and its decompressors raise where bytes of a bag have changed.
DAMAGE = (TypesysError, OSError, RuntimeError, ValueError, LookupError, AssertionError, struct.error, MemoryError)


@contextlib.contextmanager
def open_bag(path: Union[str, Path]) -> Iterator[AnyReader]:
    """Open a bag for reading.

    Raises:
        ConfigError: it is missing, or no readable bag.
    """
    path = Path(path)
    if not path.exists():
        raise ConfigError(f'{path}: no such bag')
    with _readable(path), contextlib.ExitStack() as opened:
        with naming_damage(path):
            reader = opened.enter_context(AnyReader([path]))
        yield reader


@contextlib.contextmanager
def open_ros1_bag(path: Path) -> Iterator[Reader]:
    """Open a bag for reading that must be of ROS 1, as those of trials are.

    By rosbags' own reader of ROS 1: AnyReader parses the definitions of all types first, which takes
    longer than some bags.

    Raises:
        ConfigError: it is missing, no readable bag, or of ROS 2.
    """
    if path.suffix != '.bag' or not path.exists():
        with open_bag(path):  # refuses it, unless it is of ROS 2
            raise ConfigError(f"{path}: a ROS 2 bag; expected a trial's, of ROS 1")
    with _readable(path), contextlib.ExitStack() as opened:
        with naming_damage(path):
            reader = opened.enter_context(Reader(path))
        yield reader


@contextlib.contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except (AnyReaderError, ReaderError, EOFError) as error:
        raise ConfigError(f'{path}: not a readable bag: {in_one_line(error)}') from None


@contextlib.contextmanager
def naming_damage(path: Path) -> Iterator[None]:
    """Report a bag of which bytes have changed in one line, while its messages are read.

    Raises:
        ConfigError: in place of what rosbags raises.
    """
    try:
        yield
    except ConfigError:
        raise
    except DAMAGE as error:
        reason = f'{type(error).__name__} {" ".join(str(error).split())}'
        raise ConfigError(f'{path}: a damaged bag: {reason}; expected it as it was recorded') from None


def typed_messages(path: Path, reader: Reader, types: Mapping[str, str]) -> Iterator[Tuple[Connection, bytes]]:
    """Yield the serialized messages of some topics, each with its connection.

    Args:
        path: of the bag, for messages.
        reader: from `open_ros1_bag`.
        types: by topic, as rosbags spells them.

    Raises:
        ConfigError: a topic is of another type, or the bag is damaged.
    """
    connections = [connection for connection in reader.connections if connection.topic in types]
    for connection in connections:
        _check_type(path, connection, types[connection.topic])
    with naming_damage(path):
        for connection, _, raw in reader.messages(connections) if connections else ():
            yield connection, raw


def _check_type(path: Path, connection: Connection, message_type: str) -> None:
    md5sum = definition(message_type).md5sum
    if (connection.msgtype, connection.digest) != (message_type, md5sum):
        raise ConfigError(
            f'{path}: {connection.topic} is {connection.msgtype} ({connection.digest}); '
            f'expected {message_type} ({md5sum})'
        )
