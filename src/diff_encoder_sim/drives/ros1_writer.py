"""rosbags' writer of ROS 1 bags, with the records of messages made in one piece: a trial has hundreds a second."""

from __future__ import annotations

import collections
import io
import struct
import sys
from typing import List, Sequence, Tuple, cast

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.rosbag1.writer import WriteChunk

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.wire import LENGTH

# The format's http://wiki.ros.org/Bags/Format/2.0: a header of fields, each after its length, then the data.
_TIME_SIZE = 8
_TIME_AND_LENGTH = struct.Struct('<3I')
_MESSAGE, _INDEX_DATA, _CHUNK = 2, 4, 5  # operations


def record_header(connection_id: int) -> bytes:
    """Return how the records of a connection's messages begin: all up to the time."""
    fields = _fields(op=bytes([_MESSAGE]), conn=LENGTH.pack(connection_id), time=bytes(_TIME_SIZE))
    return LENGTH.pack(len(fields)) + fields[:-_TIME_SIZE]


def _fields(**fields: bytes) -> bytes:
    """Return fields of a record's header, in this order."""
    every = [f'{name}='.encode() + value for name, value in fields.items()]
    return b''.join(LENGTH.pack(len(field)) + field for field in every)


def encode_record(header: bytes, time_ns: int, message: bytes) -> bytes:
    """Return the record of a message; its header is that of `record_header`."""
    seconds, nanoseconds = divmod(time_ns, NANOSECONDS_PER_SECOND)
    return header + _TIME_AND_LENGTH.pack(seconds, nanoseconds, len(message)) + message


def _record(operation: int, data: bytes, **fields: bytes) -> bytes:
    """Return a record of any kind, its header's fields in this order."""
    header = _fields(op=bytes([operation]), **fields)
    return LENGTH.pack(len(header)) + header + LENGTH.pack(len(data)) + data


def _index_entries(places: List[Tuple[int, int]]) -> bytes:
    """Return time and offset of each message, of which `places` has the time [ns] and the offset in the chunk."""
    times_ns, offsets = np.array(places, np.int64).T
    seconds, nanoseconds = np.divmod(times_ns, NANOSECONDS_PER_SECOND)
    return np.column_stack([seconds, nanoseconds, offsets]).astype('<u4').tobytes()


# A message's connection, time [ns] and record.
MessageRecord = Tuple[int, int, bytes]


class Ros1Writer(Writer):
    """Writes the same bytes as rosbags' own."""

    def write_message(self, connection_id: int, header: bytes, time_ns: int, message: bytes) -> None:
        """Write a message of a connection; its header is that of `record_header`."""
        self.write_records([(connection_id, time_ns, encode_record(header, time_ns, message))])

    def write_records(self, records: Sequence[MessageRecord]) -> None:
        """Write messages, whose times do not fall."""
        begun, chunk = 0, self.chunks[-1]
        place = chunk.data.tell()
        for count, (connection_id, time_ns, record) in enumerate(records, 1):
            chunk.connections[connection_id].append((time_ns, place))
            place += len(record)
            if place > self.chunk_threshold:
                _fill(chunk, records[begun:count])
                self.write_chunk(chunk)
                begun, place, chunk = count, 0, self.chunks[-1]
        if begun < len(records):
            _fill(chunk, records[begun:])

    def write_chunk(self, chunk: WriteChunk) -> None:
        """Write a chunk, and the entries of its index at once."""
        content = chunk.data.getvalue()
        if not content:
            return
        assert self.bio is not None  # open
        chunk.pos = self.bio.tell()
        compression, size = self.compression_format.encode(), LENGTH.pack(len(content))
        self.bio.write(_record(_CHUNK, self.compressor(content), compression=compression, size=size))
        for connection_id, places in chunk.connections.items():
            numbers = [LENGTH.pack(number) for number in (1, connection_id, len(places))]
            fields = dict(zip(('ver', 'conn', 'count'), numbers))
            self.bio.write(_record(_INDEX_DATA, _index_entries(places), **fields))
            # rosbags keeps the place of every message; of a chunk that is written it uses no more than their number.
            chunk.connections[connection_id] = cast('List[Tuple[int, int]]', range(len(places)))
        chunk.data.close()
        self.chunks.append(WriteChunk(io.BytesIO(), -1, sys.maxsize, 0, collections.defaultdict(list)))


def _fill(chunk: WriteChunk, records: Sequence[MessageRecord]) -> None:
    chunk.start = min(chunk.start, records[0][1])
    chunk.end = max(chunk.end, records[-1][1])
    chunk.data.write(b''.join([record for _, _, record in records]))
