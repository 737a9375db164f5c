"""Opens bags of every kind as streams of messages, and finds them in folders.

rosbags reads neither a file without index, as after a crash, nor on Python 3.8 a file of ROS 2 outside of a folder.
"""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import tempfile
import urllib.parse
import weakref
from pathlib import Path
from typing import Any, Collection, Dict, Iterator, List, Optional, Sequence

import zstandard
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, Schema

from diff_encoder_sim.base.errors import ConfigError, InputFault, in_one_line
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.ros1_stream import MAGIC, Ros1Stream

METADATA = 'metadata.yaml'
MCAP_MAGIC = b'\x89MCAP0\r\n'
SQLITE_MAGIC = b'SQLite format 3\0'

_SUFFIXES = ('.bag', '.mcap', '.db3')
_CDR = 'cdr'
_LARGEST_RECORD = 1 << 30  # [bytes]; a damaged length may be any number


class McapStream(DriveStream):
    """An MCAP file."""

    is_cdr = True

    def __init__(self, path: Path) -> None:
        """Read the topics; OSError if the file cannot be read."""
        super().__init__(path)
        with open(path, 'rb') as file, contextlib.suppress(Exception):  # mcap raises many types at the end of a file
            summary = make_reader(file).get_summary()
            if summary:
                for channel in summary.channels.values():
                    self._describe(channel, summary.schemas.get(channel.schema_id))
        if not self.topics:
            self.fault = 'no index, as after a crash'
            for _ in self.messages(()):
                pass  # adds every channel

    def _messages(self, topics: Collection[str]) -> Iterator[Message]:
        with open(self.path, 'rb') as file:
            reader = NonSeekingReader(file, validate_crcs=True, record_size_limit=_LARGEST_RECORD)
            try:
                for schema, channel, message in reader.iter_messages(log_time_order=False):
                    if channel.topic not in self.topics:
                        self._describe(channel, schema)
                    if channel.topic in topics and channel.message_encoding == _CDR:
                        yield Message(channel.topic, message.log_time, message.data)
            except Exception as error:  # mcap raises many types for a damaged file
                what = 'torn' if isinstance(error, EndOfFile) else f'damaged: {in_one_line(error)}'
                self.fault = f'at byte {file.tell()} {what}'

    def _describe(self, channel: Channel, schema: Optional[Schema]) -> None:
        if channel.message_encoding != _CDR:
            self.fault = f'{channel.topic} is left out: encoded as {channel.message_encoding!r}; expected {_CDR!r}'
        elif schema is not None:
            self.topics.setdefault(channel.topic, schema.name)
            self.definitions.setdefault(schema.name, schema.data.decode('utf-8', 'replace'))


class Sqlite3Stream(DriveStream):
    """An SQLite database."""

    is_cdr = True

    def __init__(self, path: Path, is_compressed: bool = False) -> None:
        """Read the topics; each message may be compressed by zstd. InputFault if the file has other tables."""
        super().__init__(path)
        self._uri = f'file:{urllib.parse.quote(str(path.resolve()))}?mode=ro&immutable=1'
        self._is_compressed = is_compressed
        self._topic_of: Dict[int, str] = {}  # by number in the file
        try:
            query = 'SELECT id, name, type FROM topics WHERE serialization_format = ? ORDER BY id'
            for number, topic, kind in self._rows(query, _CDR):
                self._topic_of[number] = topic
                self.topics.setdefault(topic, kind)
            if list(self._rows("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'")):
                query = 'SELECT topic_type, encoded_message_definition FROM message_definitions'
                self.definitions = dict(self._rows(query))  # older recorders leave them out
        except sqlite3.Error as error:
            raise InputFault(in_one_line(error)) from None

    def _messages(self, topics: Collection[str]) -> Iterator[Message]:
        wanted = ', '.join(str(number) for number, topic in self._topic_of.items() if topic in topics)
        query = f'SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({wanted}) ORDER BY timestamp, id'
        try:
            for number, time_ns, data in self._rows(query):
                if isinstance(time_ns, int) and isinstance(data, bytes):
                    content = zstandard.ZstdDecompressor().decompress(data) if self._is_compressed else data
                    yield Message(self._topic_of[number], time_ns, content)
                else:
                    self.fault = f'damaged: a message on {self._topic_of[number]}'
        except (sqlite3.Error, zstandard.ZstdError) as error:
            self.fault = f'damaged: {in_one_line(error)}'

    def _rows(self, query: str, *values: str) -> Iterator[Any]:
        with contextlib.closing(sqlite3.connect(self._uri, uri=True)) as database:
            yield from database.execute(query, values)


class FolderStream(DriveStream):
    """The files of a bag of ROS 2, one after the other."""

    is_cdr = True

    def __init__(self, path: Path, files: Sequence[DriveStream]) -> None:
        super().__init__(path)
        self._files = files
        for file in files:
            self.topics.update(file.topics)
            self.definitions.update(file.definitions)
        self._join_faults()

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of the files, as far as they can be read."""
        for file in self._files:
            yield from file.messages(topics)
            self._join_faults()

    def _join_faults(self) -> None:
        self.fault = '; '.join(file.fault for file in self._files if file.fault)


def is_bag_folder(path: Path) -> bool:
    """Return whether a folder is a bag of ROS 2."""
    return (path / METADATA).is_file()


def bags_in(folder: Path) -> List[Path]:
    """Return the bags in a folder and the folders in it: files of ROS 1, folders and files of ROS 2."""
    if is_bag_folder(folder):
        return [folder]
    found = [path.parent for path in folder.rglob(METADATA)]
    files = [path for path in folder.rglob('*') if path.suffix in _SUFFIXES and path.is_file()]
    return sorted([*found, *(path for path in files if path.parent not in found)])


def open_source(path: Path) -> DriveStream:
    """Open a file of ROS 1, or a file or folder of ROS 2; ConfigError if it cannot be read or has no message."""
    if not path.exists():
        raise ConfigError(f'{path}: no such bag')
    try:
        source = _open_folder(path) if path.is_dir() else _open_file(path)
    except (InputFault, OSError) as error:
        raise ConfigError(f'{path}: not a readable bag: {in_one_line(error)}') from None
    if not source.topics:
        raise ConfigError(f'{path}: no message in it{source.fault and f" ({source.fault})"}')
    return source


def _open_file(path: Path, is_compressed: bool = False) -> DriveStream:
    """Open a file by its first bytes."""
    with open(path, 'rb') as file:
        begins = file.read(max(map(len, (MAGIC, MCAP_MAGIC, SQLITE_MAGIC))))
    if begins.startswith(MAGIC):
        return Ros1Stream(path)
    if begins.startswith(MCAP_MAGIC):
        return McapStream(path)
    if begins.startswith(SQLITE_MAGIC):
        return Sqlite3Stream(path, is_compressed)
    raise InputFault('not of ROS 1, MCAP or SQLite; expected a file of ROS 1, or a folder, .db3 or .mcap of ROS 2')


def _open_folder(folder: Path) -> DriveStream:
    """Open the files that metadata.yaml names, only those next to it."""
    about = load_yaml(folder / METADATA).get('rosbag2_bagfile_information')
    names = about.get('relative_file_paths') if isinstance(about, dict) else None
    if not isinstance(about, dict) or not isinstance(names, list) or not names:
        raise InputFault(f'{METADATA}: no relative_file_paths; expected what ros2 bag record writes')
    mode, compression = (str(about.get(f'compression_{key}') or '').lower() for key in ('mode', 'format'))
    if mode not in ('', 'none') and (mode not in ('file', 'message') or compression != 'zstd'):
        raise InputFault(f'{METADATA}: compression {mode} {compression}; allowed: zstd of file or message')
    files = [folder / Path(str(name)).name for name in names]
    if mode != 'file':
        return FolderStream(folder, [_open_file(file, mode == 'message') for file in files])
    temporary = tempfile.TemporaryDirectory(prefix='diff_encoder_sim_')
    for index, path in enumerate(files):
        files[index] = Path(temporary.name) / path.stem
        try:
            with open(path, 'rb') as file, open(files[index], 'wb') as out:
                shutil.copyfileobj(zstandard.ZstdDecompressor().stream_reader(file), out)
        except zstandard.ZstdError as error:
            raise ConfigError(f'{path}: cannot be decompressed: {in_one_line(error)}') from None
    source = FolderStream(folder, [_open_file(file) for file in files])
    weakref.finalize(source, temporary.cleanup)
    return source
