"""Reads a bag of ROS 1 from its beginning to its end: without an index, and up to where it is torn."""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import BinaryIO, Collection, Dict, Iterator, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import LATEST_NS, NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_messages import BagConnection, Message
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, BoundedSum, check_size
from diff_encoder_sim.drives.wire import LENGTH, TIME, UINT32, UINT64

# A header that claims to be larger is none.
_LARGEST_HEADER = 1 << 24

HeaderFields = Dict[bytes, bytes]


def records(chunk: bytes) -> Iterator[Tuple[int, int, int]]:
    """Find the whole records of a chunk: where the header and the data of each begin, and where it ends."""
    length_at, end = LENGTH.unpack_from, len(chunk)
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


def header_fields(header: bytes) -> HeaderFields:
    """Return the values of a header's fields by name, as far as it is sound."""
    return {name: header[begin:end] for name, begin, end in _fields(header)}


def value_places(header: bytes) -> Dict[bytes, int]:
    """Return where the value of each of a header's fields begins, as far as it is sound."""
    return {name: begin for name, begin, _ in _fields(header)}


def _fields(header: bytes) -> Iterator[Tuple[bytes, int, int]]:
    """Find each field's name, and where its value begins and ends."""
    field_at = 4
    while field_at < len(header):
        field_end = field_at + LENGTH.unpack_from(header, field_at - 4)[0]
        name, equals, _ = header[field_at:field_end].partition(b'=')
        if not equals or field_end > len(header):
            return
        yield name, field_at + len(name) + 1, field_end
        field_at = field_end + 4


def read_header(file: BinaryIO) -> Optional[HeaderFields]:
    """Read the header of a record; None where the file ends before."""
    header = read_data(file)
    return None if header is None else header_fields(header)


def read_data(file: BinaryIO) -> Optional[bytes]:
    """Read a header or data as bytes; None where the file ends before."""
    length = read_length(file)
    if length is None or length > _LARGEST_HEADER:
        return None
    data = file.read(length)
    return data if len(data) == length else None


def read_length(file: BinaryIO) -> Optional[int]:
    """Read the length of a header or of data; None where the file ends before."""
    content = file.read(LENGTH.size)
    if len(content) < LENGTH.size:
        return None
    length: int = LENGTH.unpack(content)[0]
    return length


MAGIC = b'#ROSBAG V2.0\n'

_MENDED = ' (rosbag reindex mends what can be mended)'

_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_OPS_OF_FILE = [bytes([op]) for op in range(3, 8)]  # header, index, chunk, chunk info, connection


class _MessageLayout(NamedTuple):
    """Where a message's record header has its values; writers order the fields differently."""

    size: int = 0  # of the header, with the length of the data
    op_at: int = 0
    conn_at: int = 0
    time_at: int = 0


class Ros1Stream:
    """The topics of a bag, and its messages, as often as they are asked for."""

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
        self.definitions: Dict[str, str] = {}  # by type, as recorded; empty where they were not
        self.fault = ''  # why not all of it can be read
        with open(path, 'rb') as file:
            is_indexed = self._read_index(file)
        if not is_indexed:
            self.fault = f'no index, as after a crash{_MENDED}'
            for _ in self.messages(()):
                pass  # learns every connection on the way

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
        """Learn the connections where the bag lists them, and return whether it does."""
        try:
            file.seek(len(MAGIC))
            fields = read_header(file) or {}
            index_at = UINT64.unpack(fields[b'index_pos'])[0]
            if index_at > os.fstat(file.fileno()).st_size:
                return False
            file.seek(index_at)
            for _ in range(UINT32.unpack(fields[b'conn_count'])[0]):
                self._add_connection(read_header(file) or {}, read_data(file) or b'')
        except (KeyError, struct.error):
            return False
        return bool(self.topics)

    def _add_connection(self, fields: HeaderFields, data: bytes) -> None:
        described = {name: value.decode('utf-8', 'replace') for name, value in header_fields(data).items()}
        connection = BagConnection(
            fields[b'topic'].decode('utf-8', 'replace'),
            described[b'type'].replace('/', '/msg/', 1),
            described.get(b'md5sum', ''),
            described.get(b'callerid', ''),
        )
        self._connections[UINT32.unpack(fields[b'conn'])[0]] = connection
        self.topics.setdefault(connection.topic, connection.message_type)
        self.definitions.setdefault(connection.message_type, described.get(b'message_definition', ''))

    def _chunks(self, file: BinaryIO) -> Iterator[Tuple[int, bytes]]:
        """Yield place and content of chunks, uncompressed, up to the end or to where the file is torn."""
        size = os.fstat(file.fileno()).st_size
        total = BoundedSum(size)
        file.seek(len(MAGIC))
        while file.tell() < size:
            begins_at = file.tell()
            fields, length = read_header(file), read_length(file)
            if fields is None or length is None:
                self.fault = f'torn at byte {begins_at}{_MENDED}'
                return
            if not fields:
                self.fault = f'damaged: an empty record header at byte {begins_at}{_MENDED}'
                return
            if fields.get(b'op') not in _OPS_OF_FILE:
                self.fault = f'damaged: the record at byte {begins_at} has no known op'
            if fields.get(b'op') != bytes([_CHUNK]):
                file.seek(length, os.SEEK_CUR)
                continue
            ends_at = file.tell() + (length or size)  # a recorder that is killed leaves its last chunk with 0
            if min(ends_at, size) < ends_at:
                self.fault = f'torn in the chunk at byte {begins_at}{_MENDED}'
            try:
                chunk = _chunk(file, fields, min(ends_at, size) - file.tell(), length > 0, total)
            except InputFault as fault:
                self.fault = f'damaged: the chunk at byte {begins_at} {fault}'
            else:
                yield begins_at, chunk
            file.seek(ends_at)

    def _messages_of(self, chunk: bytes, begins_at: int, wanted: Dict[int, BagConnection]) -> Iterator[Message]:
        number_at, time_of = UINT32.unpack_from, TIME.unpack_from
        layout = self._layout
        for header_at, data_at, end in records(chunk):
            if data_at - header_at != layout.size or chunk[header_at + layout.op_at] != _MESSAGE:
                header = chunk[header_at : data_at - 4]
                fields = header_fields(header)
                if not fields:
                    self.fault = (
                        f'damaged: an empty record header at byte {header_at - 4} of the content of the chunk at byte '
                        f'{begins_at}{_MENDED}'
                    )
                    return
                if not self._learn(header, fields, chunk[data_at:end]):
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

    def _learn(self, header: bytes, fields: HeaderFields, data: bytes) -> bool:
        """Process a record that is no message in the usual layout, and return whether it is one in another."""
        try:
            op = fields[b'op']
            if op == bytes([_CONNECTION]):
                self._add_connection(fields, data)
            if op != bytes([_MESSAGE]):
                return False
            UINT32.unpack(fields[b'conn'])
            TIME.unpack(fields[b'time'])
        except (KeyError, struct.error):
            self.fault = 'damaged: a record has no proper header'
            return False
        places = value_places(header)
        self._layout = _MessageLayout(len(header) + LENGTH.size, places[b'op'], places[b'conn'], places[b'time'])
        return True


def _chunk(file: BinaryIO, fields: HeaderFields, length: int, is_whole: bool, total: BoundedSum) -> bytes:
    """Read `length` bytes of a chunk, and decompress what there is of it.

    Raises:
        InputFault: it is too large, becomes larger than it says, or is damaged.
    """
    if is_whole:
        check_size(length)
    length = min(length, LARGEST_CHUNK)  # after power loss, zeros may follow what was written of the last chunk
    compression = fields.get(b'compression', b'').decode('utf-8', 'replace')
    said = LARGEST_CHUNK
    if is_whole and len(fields.get(b'size', b'')) == UINT32.size:
        said = UINT32.unpack(fields[b'size'])[0]
    return total.decompressed(compression, file.read(length), said)
