"""The files that a trial's bag is written to: a bag of ROS 1, or an MCAP file of ROS 2."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from mcap.writer import CompressionType, Writer
from typing_extensions import Protocol

from diff_encoder_sim.drives.ros1_writer import Ros1Writer, encode_record, record_header
from diff_encoder_sim.drives.topics import BagFormat, RecordedTopic
from diff_encoder_sim.drives.typestore import definition, ros2_definition, to_cdr
from diff_encoder_sim.drives.wire import with_seq

SUFFIXES: Dict[BagFormat, str] = {'ros1': '.bag', 'mcap': '.mcap'}


# A message in the form of a file: its connection or channel, its time [ns], its content.
Prepared = Tuple[int, int, bytes]


class BagFile(Protocol):
    """A file that is being written; OSError where it cannot be."""

    def add_publisher(self, topic: RecordedTopic, node: str) -> int:
        """Describe a topic and the node that publishes it, and return a number for `prepare`."""

    def prepare(self, publisher: int, time_ns: int, message: bytes, seq: Optional[int] = None) -> Prepared:
        """Return a message that is encoded for ROS 1 as `write` takes it.

        The seq of a leading header is filled in: the next one of the publisher, from 1, unless it is given.
        """

    def write(self, messages: Sequence[Prepared]) -> None:
        """Write messages, whose times do not fall."""

    def close(self) -> None:
        """Write the index, and close the file."""

    def abandon(self) -> None:
        """Close the file as it is."""


class _Publisher(NamedTuple):
    """One node's connection of one topic."""

    connection_id: int
    header: bytes  # of the records of its messages
    seqs: Optional[Iterator[int]]  # of its messages; None where they have no header


class Ros1File:
    """A bag of ROS 1, written by rosbags. Memory does not grow with the bag."""

    def __init__(self, path: Path) -> None:
        self._publishers: List[_Publisher] = []
        self._writer = Ros1Writer(path)
        self._writer.open()

    def add_publisher(self, topic: RecordedTopic, node: str) -> int:
        """Add a connection."""
        described = definition(topic.message_type)
        connection = self._writer.add_connection(
            topic.name,
            topic.message_type,
            msgdef=described.text,
            md5sum=described.md5sum,
            callerid=node,
            latching=int(topic.is_latched),
        )
        seqs = itertools.count(1) if described.has_header else None
        self._publishers.append(_Publisher(connection.id, record_header(connection.id), seqs))
        return len(self._publishers) - 1

    def prepare(self, publisher: int, time_ns: int, message: bytes, seq: Optional[int] = None) -> Prepared:
        """Make the record of a message."""
        connection_id, header, seqs = self._publishers[publisher]
        if seqs is not None:
            message = with_seq(message, next(seqs) if seq is None else seq)
        return connection_id, time_ns, encode_record(header, time_ns, message)

    def write(self, messages: Sequence[Prepared]) -> None:
        """Write messages."""
        self._writer.write_records(messages)

    def close(self) -> None:
        """Write the index, and close the file."""
        self._writer.close()

    def abandon(self) -> None:
        """Close the file as it is."""
        if self._writer.bio is not None:
            self._writer.bio.close()


class McapFile:
    """An MCAP file of ROS 2: a channel for each topic, messages in CDR."""

    def __init__(self, path: Path) -> None:
        self._file = open(path, 'wb')  # noqa: SIM115 - closed by close or abandon
        self._writer = Writer(self._file, compression=CompressionType.NONE)
        self._writer.start('ros2', 'diff_encoder_sim')
        self._topics: Dict[str, int] = {}
        self._schemas: Dict[str, int] = {}  # by type
        self._types: Dict[int, str] = {}  # by channel
        self._counts: Dict[int, int] = {}  # messages, by channel

    def add_publisher(self, topic: RecordedTopic, node: str) -> int:
        """Add a channel, unless the topic has one: ROS 2 records no publishers."""
        if topic.name not in self._topics:
            text, type_hash = ros2_definition(topic.message_type)
            if topic.message_type not in self._schemas:
                schema = self._writer.register_schema(topic.message_type, 'ros2msg', text.encode())
                self._schemas[topic.message_type] = schema
            about = {'offered_qos_profiles': qos_profiles(topic.is_latched), 'topic_type_hash': type_hash}
            channel = self._writer.register_channel(topic.name, 'cdr', self._schemas[topic.message_type], about)
            self._topics[topic.name], self._types[channel], self._counts[channel] = channel, topic.message_type, 0
        return self._topics[topic.name]

    def prepare(self, publisher: int, time_ns: int, message: bytes, seq: Optional[int] = None) -> Prepared:
        """Convert a message to CDR, which has no seq."""
        del seq
        return publisher, time_ns, to_cdr(message, self._types[publisher])

    def write(self, messages: Sequence[Prepared]) -> None:
        """Write messages."""
        for channel, time_ns, content in messages:
            self._counts[channel] += 1
            self._writer.add_message(channel, time_ns, content, time_ns, self._counts[channel])

    def close(self) -> None:
        """Write the index, and close the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()

    def abandon(self) -> None:
        """Close the file as it is."""
        self._file.close()


def qos_profiles(is_latched: bool) -> str:
    """Return how a topic was published, in the YAML of rosbag2: latched topics are transient local in ROS 2."""
    no_limit = '{sec: 9223372036, nsec: 854775807}'
    fields = {
        'history': 1,  # keep last
        'depth': 1 if is_latched else 10,
        'reliability': 1,  # reliable
        'durability': 1 if is_latched else 2,  # transient local or volatile
        'deadline': no_limit,
        'lifespan': no_limit,
        'liveliness': 1,  # automatic
        'liveliness_lease_duration': no_limit,
        'avoid_ros_namespace_conventions': 'false',
    }
    return '- ' + '\n  '.join(f'{key}: {value}' for key, value in fields.items())


OPENERS: Dict[BagFormat, Callable[[Path], BagFile]] = {'ros1': Ros1File, 'mcap': McapFile}
