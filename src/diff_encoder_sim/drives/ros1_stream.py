"""Reads ROS 1 bags (http://wiki.ros.org/Bags/Format/2.0): unlike rosbags also without an index, or up to a tear."""

from __future__ import annotations

import bz2
import contextlib
import os
import struct
from pathlib import Path
from typing import BinaryIO, Callable, Collection, Dict, Iterator, Tuple

import lz4.frame

from diff_encoder_sim.base.errors import InputFault, in_one_line
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.drive_stream import DriveStream, Message

MAGIC = b'#ROSBAG V2.0\n'
LARGEST_CHUNK = 1 << 27  # [bytes] before and after decompression; recorders close a chunk at 1 to 4 MiB

_UINT32, _UINT64, _TIME = struct.Struct('<I'), struct.Struct('<Q'), struct.Struct('<2I')
_LARGEST_HEADER = 1 << 24  # [bytes]; a larger one is damaged
_MENDED = ' (rosbag reindex mends what can be mended)'
_MESSAGE, _CHUNK, _CONNECTION = b'\2', b'\5', b'\7'
_OPS_OF_FILE = [bytes([op]) for op in range(3, 8)]  # header, index, chunk, chunk info, connection

# Fields in the header of a message, each after its length; writers order them differently.
_OP_OF_MESSAGE, _CONN, _TIME_FIELD = b'\4\0\0\0op=' + _MESSAGE, b'\x09\0\0\0conn=', b'\x0d\0\0\0time='

# Decompress up to a number of bytes; data whose end is missing are decompressed as far as they go.
_DECOMPRESSORS: Dict[str, Callable[[bytes, int], bytes]] = {
    'bz2': lambda data, size: bz2.BZ2Decompressor().decompress(data, max_length=size),
    'lz4': lambda data, size: bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)),
    'none': lambda data, size: data[:size],
}


class Ros1Stream(DriveStream):
    """A bag of ROS 1."""

    def __init__(self, path: Path) -> None:
        """Read the topics of a file that begins with `MAGIC`; OSError if it cannot be read."""
        super().__init__(path)
        self._connections: Dict[bytes, Tuple[str, str]] = {}  # topic and node by encoded number
        if not self._read_index():
            self.fault = f'no index, as after a crash{_MENDED}'
            for _ in self.messages(()):
                pass  # adds every connection

    def _messages(self, topics: Collection[str]) -> Iterator[Message]:
        wanted = {number: each for number, each in self._connections.items() if each[0] in topics}
        with open(self.path, 'rb') as file:
            for at, chunk in self._chunks(file):
                for begin, data_at, end in _records(chunk):
                    header = chunk[begin : data_at - _UINT32.size]
                    if _OP_OF_MESSAGE not in header:
                        try:
                            self._add_connection(_fields(header), chunk[data_at:end])
                        except KeyError:
                            self.fault = f'damaged: a record in the chunk at byte {at} has no proper header{_MENDED}'
                        continue
                    number_at, time_at = header.find(_CONN) + len(_CONN), header.find(_TIME_FIELD) + len(_TIME_FIELD)
                    connection = wanted.get(header[number_at : number_at + _UINT32.size])
                    if connection and len(_TIME_FIELD) <= time_at <= len(header) - _TIME.size:
                        seconds, nanoseconds = _TIME.unpack_from(header, time_at)
                        time_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
                        yield Message(connection[0], time_ns, chunk[data_at:end], connection[1])

    def _read_index(self) -> bool:
        """Add the connections of the index, and return whether there is one."""
        with contextlib.suppress(KeyError, struct.error), open(self.path, 'rb') as file:
            file.seek(len(MAGIC))
            fields, _ = _read_header(file)
            index_at, count = _UINT64.unpack(fields[b'index_pos'])[0], _UINT32.unpack(fields[b'conn_count'])[0]
            file.seek(min(index_at, self.path.stat().st_size))
            for _ in range(count):
                fields, length = _read_header(file)
                self._add_connection(fields, file.read(min(length, _LARGEST_HEADER)))
            return bool(self.topics)
        return False

    def _add_connection(self, fields: Dict[bytes, bytes], data: bytes) -> None:
        """Add a connection, ignore another record; KeyError if a field is missing."""
        if fields[b'op'] != _CONNECTION:
            return
        about = {name: value.decode('utf-8', 'replace') for name, value in _fields(data).items()}
        topic, kind = fields[b'topic'].decode('utf-8', 'replace'), about[b'type'].replace('/', '/msg/', 1)
        self._connections[fields[b'conn']] = topic, about.get(b'callerid', '')
        self.topics.setdefault(topic, kind)
        self.definitions.setdefault(kind, about.get(b'message_definition', ''))

    def _chunks(self, file: BinaryIO) -> Iterator[Tuple[int, bytes]]:
        """Yield place and content of chunks, decompressed, up to the end or to the byte at which the file is torn."""
        size = os.fstat(file.fileno()).st_size
        file.seek(len(MAGIC))
        while file.tell() < size:
            begin = file.tell()
            try:
                fields, length = _read_header(file)
            except struct.error:
                self.fault = f'torn at byte {begin}{_MENDED}'
                return
            if not fields:
                self.fault = f'damaged: an empty record header at byte {begin}{_MENDED}'
                return
            if fields.get(b'op') not in _OPS_OF_FILE:
                self.fault = f'damaged: the record at byte {begin} has no known op'
            if fields.get(b'op') != _CHUNK:
                file.seek(length, os.SEEK_CUR)
                continue
            end = file.tell() + (length or size)  # a recorder that is killed leaves its last chunk with 0
            if end > size:
                self.fault = f'torn in the chunk at byte {begin}{_MENDED}'
            try:
                yield begin, _decompressed(file.read(min(end - file.tell(), LARGEST_CHUNK)), fields, length > 0)
            except InputFault as fault:
                self.fault = f'damaged: the chunk at byte {begin} {fault}'
            file.seek(end)


def _decompressed(data: bytes, fields: Dict[bytes, bytes], is_whole: bool) -> bytes:
    """Decompress a chunk as far as it goes and its header or `LARGEST_CHUNK` allows: 5 kB of bz2 can become 2 GB."""
    compression, size = fields.get(b'compression', b'').decode('utf-8', 'replace'), LARGEST_CHUNK
    if is_whole and len(fields.get(b'size', b'')) == _UINT32.size:
        size = _UINT32.unpack(fields[b'size'])[0]
    if size > LARGEST_CHUNK:
        raise InputFault(f'has {size} bytes; allowed: at most {LARGEST_CHUNK}')
    if compression not in _DECOMPRESSORS:
        raise InputFault(f'compressed by {compression!r}; expected {", ".join(_DECOMPRESSORS)}')
    try:
        content = _DECOMPRESSORS[compression](data, size + 1)
    except Exception as error:  # each library has its own, down to RuntimeError
        raise InputFault(f'cannot be decompressed: {in_one_line(error)}') from None
    if len(content) > size:
        raise InputFault(f'becomes larger than the {size} bytes of its header')
    return content


def _records(chunk: bytes) -> Iterator[Tuple[int, int, int]]:
    """Find the complete records of a chunk: the beginnings of the header and of the data, and the end of each."""
    length_at, end, begin = _UINT32.unpack_from, len(chunk), 4
    while begin <= end:
        data_at = begin + length_at(chunk, begin - 4)[0] + 4
        if data_at > end:
            return
        record_end = data_at + length_at(chunk, data_at - 4)[0]
        if record_end > end:
            return
        yield begin, data_at, record_end
        begin = record_end + 4


def _fields(header: bytes) -> Dict[bytes, bytes]:
    """Return the values of a header's fields by name, as far as it is sound."""
    fields, begin = {}, 4
    while begin < len(header):
        end = begin + _UINT32.unpack_from(header, begin - 4)[0]
        name, equals, value = header[begin:end].partition(b'=')
        if not equals or end > len(header):
            break
        fields[name], begin = value, end + 4
    return fields


def _read_header(file: BinaryIO) -> Tuple[Dict[bytes, bytes], int]:
    """Read the fields of a record's header, and the length of its data; struct.error if the file ends before."""
    length = _UINT32.unpack(file.read(_UINT32.size))[0]
    if length > _LARGEST_HEADER:
        raise struct.error
    return _fields(file.read(length)), _UINT32.unpack(file.read(_UINT32.size))[0]
