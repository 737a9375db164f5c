"""Reads a bag of ROS 1 from its beginning to its end: without an index, and up to the byte at which it is torn.

rosbags reads whole bags only, and keeps the place of every message in memory. The format:
http://wiki.ros.org/Bags/Format/2.0.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import BinaryIO, Collection, Dict, Iterator, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import LATEST_NS, NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, BoundedSum, check_size

MAGIC = b'#ROSBAG V2.0\n'

_UINT32, _UINT64, _TIME = struct.Struct('<I'), struct.Struct('<Q'), struct.Struct('<2I')
_LARGEST_HEADER = 1 << 24  # [bytes]; a larger one is damaged
_MENDED = ' (rosbag reindex mends what can be mended)'
_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_OPS_OF_FILE = [bytes([op]) for op in range(3, 8)]  # header, index, chunk, chunk info, connection


class BagConnection(NamedTuple):
    """One topic's publisher as the bag describes it."""

    topic: str
    message_type: str  # as rosbags spells it
    md5sum: str = ''  # of the type's definition; ROS 2 has none
    node: str = ''  # that published; ROS 2 does not record it


class Message(NamedTuple):
    """One message as it was recorded."""

    topic: str
    time_ns: int  # when it was recorded, by the recorder's clock
    raw: bytes
    node: str = ''  # of its connection


class _MessageLayout(NamedTuple):
    """Places of the values in the header of a message's record; writers order the fields differently."""

    size: int = 0  # of the header, with the length of the data
    op_at: int = 0
    conn_at: int = 0
    time_at: int = 0


class Ros1Stream:
    """The topics of a bag, and its messages, which may be read several times."""

    is_cdr = False

    def __init__(self, path: Path) -> None:
        """Read the topics.

        Args:
            path: of a file that begins with `MAGIC`.

        Raises:
            OSError: it cannot be read.
        """
        self._path = path
        self._layout = _MessageLayout()
        self._connections: Dict[int, BagConnection] = {}
        self.topics: Dict[str, str] = {}  # types by topic, as rosbags spells them
        self.definitions: Dict[str, str] = {}  # by type, as recorded; empty if they were not
        self.fault = ''  # why not all of it can be read
        with open(path, 'rb') as file:
            is_indexed = self._read_index(file)
        if not is_indexed:
            self.fault = f'no index, as after a crash{_MENDED}'
            for _ in self.messages(()):
                pass  # which adds every connection

    @property
    def connections(self) -> List[BagConnection]:
        """Return the connections in the order of their first message."""
        return list(self._connections.values())

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics as they were written.

        Raises:
            OSError: the file cannot be read.
        """
        wanted = {number: each for number, each in self._connections.items() if each.topic in topics}
        with open(self._path, 'rb') as file:
            for begins_at, chunk in self._chunks(file):
                yield from self._messages_of(chunk, begins_at, wanted)

    def _read_index(self, file: BinaryIO) -> bool:
        """Add the connections that the index lists, and return whether there is one."""
        try:
            file.seek(len(MAGIC))
            fields = _fields(_read_part(file) or b'')
            index_at = _UINT64.unpack(fields[b'index_pos'])[0]
            if index_at > os.fstat(file.fileno()).st_size:
                return False
            file.seek(index_at)
            for _ in range(_UINT32.unpack(fields[b'conn_count'])[0]):
                self._add_connection(_fields(_read_part(file) or b''), _read_part(file) or b'')
        except (KeyError, struct.error):
            return False
        return bool(self.topics)

    def _add_connection(self, fields: Dict[bytes, bytes], data: bytes) -> None:
        described = {name: value.decode('utf-8', 'replace') for name, value in _fields(data).items()}
        connection = BagConnection(
            fields[b'topic'].decode('utf-8', 'replace'),
            described[b'type'].replace('/', '/msg/', 1),
            described.get(b'md5sum', ''),
            described.get(b'callerid', ''),
        )
        self._connections[_UINT32.unpack(fields[b'conn'])[0]] = connection
        self.topics.setdefault(connection.topic, connection.message_type)
        self.definitions.setdefault(connection.message_type, described.get(b'message_definition', ''))

    def _chunks(self, file: BinaryIO) -> Iterator[Tuple[int, bytes]]:
        """Yield place and content of chunks, uncompressed, up to the end or to the byte at which the file is torn."""
        size = os.fstat(file.fileno()).st_size
        total = BoundedSum(size)
        file.seek(len(MAGIC))
        while file.tell() < size:
            begins_at = file.tell()
            header, length = _read_part(file), _read_length(file)
            if header is None or length is None:
                self.fault = f'torn at byte {begins_at}{_MENDED}'
                return
            fields = _fields(header)
            if not fields:
                self.fault = f'damaged: an empty record header at byte {begins_at}{_MENDED}'
                return
            if fields.get(b'op') not in _OPS_OF_FILE:
                self.fault = f'damaged: the record at byte {begins_at} has no known op'
            if fields.get(b'op') != bytes([_CHUNK]):
                file.seek(length, os.SEEK_CUR)
                continue
            ends_at = file.tell() + (length or size)  # a recorder that is killed leaves its last chunk with 0
            if ends_at > size:
                self.fault = f'torn in the chunk at byte {begins_at}{_MENDED}'
            try:
                chunk = _read_chunk(file, fields, min(ends_at, size) - file.tell(), length > 0, total)
            except InputFault as fault:
                self.fault = f'damaged: the chunk at byte {begins_at} {fault}'
            else:
                yield begins_at, chunk
            file.seek(ends_at)

    def _messages_of(self, chunk: bytes, begins_at: int, wanted: Dict[int, BagConnection]) -> Iterator[Message]:
        number_at, time_of = _UINT32.unpack_from, _TIME.unpack_from
        layout = self._layout
        for header_at, data_at, end in _records(chunk):
            if data_at - header_at != layout.size or chunk[header_at + layout.op_at] != _MESSAGE:
                header = chunk[header_at : data_at - 4]
                if not _fields(header):
                    self.fault = (
                        f'damaged: an empty record header at byte {header_at - 4} of the content of the chunk at byte '
                        f'{begins_at}{_MENDED}'
                    )
                    return
                if not self._add_record(header, chunk[data_at:end]):
                    continue
                layout = self._layout
            connection = wanted.get(number_at(chunk, header_at + layout.conn_at)[0])
            if connection is not None:
                seconds, nanoseconds = time_of(chunk, header_at + layout.time_at)
                time_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
                if time_ns < LATEST_NS:
                    yield Message(connection.topic, time_ns, chunk[data_at:end], connection.node)
                else:
                    self.fault = f'damaged: a message on {connection.topic} has no time before 2^32 s'

    def _add_record(self, header: bytes, data: bytes) -> bool:
        """Process a record that is no message in the last layout, and return whether it is one in another."""
        fields = _fields(header)
        try:
            if fields[b'op'] == bytes([_CONNECTION]):
                self._add_connection(fields, data)
            if fields[b'op'] != bytes([_MESSAGE]):
                return False
            _UINT32.unpack(fields[b'conn'])
            _TIME.unpack(fields[b'time'])
        except (KeyError, struct.error):
            self.fault = 'damaged: a record has no proper header'
            return False
        places = {name: begin for name, begin, _ in _field_places(header)}
        self._layout = _MessageLayout(len(header) + _UINT32.size, places[b'op'], places[b'conn'], places[b'time'])
        return True


def _records(chunk: bytes) -> Iterator[Tuple[int, int, int]]:
    """Find the whole records of a chunk: the beginnings of the header and of the data, and the end of each."""
    length_at, end = _UINT32.unpack_from, len(chunk)
    header_at = 4
    while header_at <= end:
        data_at = header_at + length_at(chunk, header_at - 4)[0] + 4
        if data_at > end:
            return
        record_end = data_at + length_at(chunk, data_at - 4)[0]
        if record_end > end:
            return
        yield header_at, data_at, record_end
        header_at = record_end + 4


def _fields(header: bytes) -> Dict[bytes, bytes]:
    """Return the values of a header's fields by name, as far as it is sound."""
    return {name: header[begin:end] for name, begin, end in _field_places(header)}


def _field_places(header: bytes) -> Iterator[Tuple[bytes, int, int]]:
    """Find each field's name, and the beginning and the end of its value."""
    field_at = 4
    while field_at < len(header):
        field_end = field_at + _UINT32.unpack_from(header, field_at - 4)[0]
        name, equals, _ = header[field_at:field_end].partition(b'=')
        if not equals or field_end > len(header):
            return
        yield name, field_at + len(name) + 1, field_end
        field_at = field_end + 4


def _read_part(file: BinaryIO) -> Optional[bytes]:
    """Read a header or data; None if the file ends before."""
    length = _read_length(file)
    if length is None or length > _LARGEST_HEADER:
        return None
    data = file.read(length)
    return data if len(data) == length else None


def _read_length(file: BinaryIO) -> Optional[int]:
    content = file.read(_UINT32.size)
    return _UINT32.unpack(content)[0] if len(content) == _UINT32.size else None


def _read_chunk(file: BinaryIO, fields: Dict[bytes, bytes], length: int, is_whole: bool, total: BoundedSum) -> bytes:
    """Read `length` bytes of a chunk, and decompress them as far as they go.

    Raises:
        InputFault: it is too large, becomes larger than its header allows, or is damaged.
    """
    size = LARGEST_CHUNK
    if is_whole:
        check_size(length)
        if len(fields.get(b'size', b'')) == _UINT32.size:
            size = _UINT32.unpack(fields[b'size'])[0]
    compression = fields.get(b'compression', b'').decode('utf-8', 'replace')
    # After power loss, zeros may follow what was written of the last chunk.
    return total.decompressed(compression, file.read(min(length, LARGEST_CHUNK)), size)
