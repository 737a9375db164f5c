"""The files that a trial's bag is written to: a bag of ROS 1, or an MCAP file of ROS 2."""

from __future__ import annotations

import io
import itertools
import struct
from functools import partial
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union, cast

import lz4.frame
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag1.reader import RecordType
from rosbags.rosbag1.writer import Header, WriteChunk

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.message_encoders import TIME, with_seq
from diff_encoder_sim.drives.topics import BagFormat, RecordedTopic
from diff_encoder_sim.drives.typestore import definition, ros2_definition, to_cdr

SUFFIXES: Dict[BagFormat, str] = {'ros1': '.bag', 'mcap': '.mcap'}

# A message in the form of a file: its connection or channel, its time [ns], its content.
Prepared = Tuple[int, int, bytes]

_TIME_AND_LENGTH = struct.Struct('<3I')


class Ros1File(Ros1Writer):
    """A bag of ROS 1, with the same bytes as rosbags' writer, five times as fast; memory does not grow with the bag."""

    def __init__(self, path: Path, is_compressed: bool = False) -> None:
        """Open a new file, compressed by LZ4 or not; OSError if it cannot be created."""
        super().__init__(path)
        # Of each publisher: its connection, the beginning of its records, and the seqs of its messages with a header.
        self._publishers: List[Tuple[int, bytes, Optional[Iterator[int]]]] = []
        if is_compressed:
            self.set_compression(self.CompressionFormat.LZ4)
            # rosbag reads only frames of this form.
            self.compressor = partial(lz4.frame.compress, block_linked=False, store_size=False, content_checksum=True)
        self.open()

    def add_publisher(self, topic: RecordedTopic, node: str) -> int:
        """Describe a topic and its publisher, and return a number for `prepare`."""
        known = definition(topic.message_type)
        about = {'msgdef': known.text, 'md5sum': known.md5sum, 'callerid': node, 'latching': int(topic.is_latched)}
        connection = self.add_connection(topic.name, topic.message_type, **about)  # type: ignore[arg-type]
        seqs = itertools.count(1) if known.has_header else None
        self._publishers.append((connection.id, record_header(connection.id), seqs))
        return len(self._publishers) - 1

    def prepare(self, publisher: int, time_ns: int, message: bytes) -> Prepared:
        """Return the record of a ROS 1 message; the seq of a leading header is the publisher's next one, from 1."""
        connection_id, header, seqs = self._publishers[publisher]
        if seqs is not None:
            message = with_seq(message, next(seqs))
        return connection_id, time_ns, encode_record(header, time_ns, message)

    def write_prepared(self, records: Sequence[Prepared]) -> None:
        """Write messages in the order of their times."""
        begin, chunk = 0, self.chunks[-1]
        place = chunk.data.tell()
        for count, (connection_id, time_ns, record) in enumerate(records, 1):
            chunk.connections[connection_id].append((time_ns, place))
            place += len(record)
            if place > self.chunk_threshold:
                _fill(chunk, records[begin:count])
                self.write_chunk(chunk)
                begin, place, chunk = count, 0, self.chunks[-1]
        if begin < len(records):
            _fill(chunk, records[begin:])

    def write_chunk(self, chunk: WriteChunk) -> None:
        """Write a chunk and its index."""
        super().write_chunk(chunk)
        # rosbags keeps the place of every message; of a written chunk it uses only their number.
        for connection_id, places in chunk.connections.items():
            chunk.connections[connection_id] = cast('List[Tuple[int, int]]', range(len(places)))

    def abandon(self) -> None:
        """Close the file without an index."""
        if self.bio is not None:
            self.bio.close()


def record_header(connection_id: int) -> bytes:
    """Return the beginning of the records of a connection's messages, up to the time."""
    header, record = Header(), io.BytesIO()
    header.set_uint32('conn', connection_id)
    header.set_time('time', 0)
    header.write(record, RecordType.MSGDATA)
    return record.getvalue()[: -TIME.size]


def encode_record(header: bytes, time_ns: int, message: bytes) -> bytes:
    """Return the record of a message; its header is that of `record_header`."""
    seconds, nanoseconds = divmod(time_ns, NANOSECONDS_PER_SECOND)
    return header + _TIME_AND_LENGTH.pack(seconds, nanoseconds, len(message)) + message


def _fill(chunk: WriteChunk, records: Sequence[Prepared]) -> None:
    chunk.start = min(chunk.start, records[0][1])
    chunk.end = max(chunk.end, records[-1][1])
    chunk.data.write(b''.join([record for _, _, record in records]))


class McapFile:
    """An MCAP file of ROS 2: a channel for each topic, messages in CDR."""

    def __init__(self, path: Path) -> None:
        """Open a new file; OSError if it cannot be created."""
        self._file = open(path, 'wb')  # noqa: SIM115 - closed by close or abandon
        self._writer = McapWriter(self._file, compression=CompressionType.NONE)
        self._writer.start('ros2', 'diff_encoder_sim')
        self._channels: Dict[str, int] = {}  # by topic
        self._schemas: Dict[str, int] = {}  # by type
        self._types: Dict[int, str] = {}  # by channel
        self._counts: Dict[int, int] = {}  # messages, by channel

    def add_publisher(self, topic: RecordedTopic, node: str) -> int:
        """Add a channel, unless the topic has one: ROS 2 records no publishers."""
        del node
        if topic.name not in self._channels:
            kind = topic.message_type
            text, type_hash = ros2_definition(kind)
            if kind not in self._schemas:
                self._schemas[kind] = self._writer.register_schema(kind, 'ros2msg', text.encode())
            about = {'offered_qos_profiles': qos_profiles(topic.is_latched), 'topic_type_hash': type_hash}
            channel = self._writer.register_channel(topic.name, 'cdr', self._schemas[kind], about)
            self._channels[topic.name], self._types[channel], self._counts[channel] = channel, kind, 0
        return self._channels[topic.name]

    def prepare(self, publisher: int, time_ns: int, message: bytes) -> Prepared:
        """Convert a ROS 1 message to CDR, which has no seq."""
        return publisher, time_ns, to_cdr(message, self._types[publisher])

    def write_prepared(self, messages: Sequence[Prepared]) -> None:
        """Write messages in the order of their times."""
        for channel, time_ns, content in messages:
            self._counts[channel] += 1
            self._writer.add_message(channel, time_ns, content, time_ns, self._counts[channel])

    def close(self) -> None:
        """Write the index, and close the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()

    def abandon(self) -> None:
        """Close the file without an index."""
        self._file.close()


def qos_profiles(is_latched: bool) -> str:
    """Return the quality of service of a publisher, in the YAML of rosbag2: latched topics are transient local."""
    depth, durability = (1, 1) if is_latched else (10, 2)  # 2 is volatile; the others: keep last, reliable, automatic
    no_limit = '{sec: 9223372036, nsec: 854775807}'
    return (
        f'- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline: {no_limit}\n'
        f'  lifespan: {no_limit}\n  liveliness: 1\n  liveliness_lease_duration: {no_limit}\n'
        '  avoid_ros_namespace_conventions: false'
    )


BagFile = Union[Ros1File, McapFile]
OPENERS: Dict[BagFormat, Callable[[Path], BagFile]] = {'ros1': Ros1File, 'mcap': McapFile}
