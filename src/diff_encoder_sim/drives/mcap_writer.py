"""Writes an MCAP file of ROS 2, in chunks as they are complete; equal calls write equal bytes.

rosbags for Python 3.8 cannot, and for others writes a folder (docs/adr/0023-bags-in-and-out.md).
"""

from __future__ import annotations

import struct
import zlib
from typing import BinaryIO, Dict, List, NamedTuple, Tuple

from diff_encoder_sim.drives.mcap_records import (
    CHUNK_HEAD,
    FOOTER,
    MAGIC,
    MESSAGE_HEAD,
    Opcode,
    encode_list,
    encode_record,
    encode_texts,
)
from diff_encoder_sim.drives.wire import UINT16, UINT32, UINT64, encode_text

CHUNK_SIZE = 1 << 20  # [bytes], after which a chunk is complete

_PROFILE, _LIBRARY = 'ros2', 'diff_encoder_sim'
_SCHEMA_ENCODING, _MESSAGE_ENCODING = 'ros2msg', 'cdr'
_UNCOMPRESSED = encode_text('')
_PLACE = struct.Struct('<QQ')  # time of recording [ns], where the message begins in its chunk
_CHANNEL_PLACE = struct.Struct('<HQ')
_COUNTS = struct.Struct('<QHIIII')  # messages, schemas, channels, attachments, metadata, chunks
_SUMMARY_OFFSET = struct.Struct('<BQQ')  # opcode, where such records begin, their size


class _Channel(NamedTuple):
    """A topic: its record, and how many messages there are."""

    record: bytes
    places: List[Tuple[int, int]]  # of the messages in the chunk that is being filled


class McapWriter:
    """A file that is being written."""

    def __init__(self, file: BinaryIO) -> None:
        """Write the beginning."""
        self._file = file
        self._schemas: Dict[str, bytes] = {}  # records by type
        self._channels: List[_Channel] = []
        self._counts: List[int] = []  # of messages, by channel
        self._chunk: List[bytes] = []
        self._chunk_size = 0
        self._chunk_indexes: List[bytes] = []
        self._first_ns, self._last_ns = 0, 0
        file.write(MAGIC + encode_record(Opcode.HEADER, encode_text(_PROFILE), encode_text(_LIBRARY)))

    def add_channel(self, topic: str, message_type: str, definition: str, about: Dict[str, str]) -> int:
        """Describe a topic, and return its number for `write`.

        Args:
            topic: its name.
            message_type: of its messages.
            definition: of the type, as ROS 2 has it.
            about: what rosbag2 wants to know of a topic.
        """
        if message_type not in self._schemas:
            texts = (encode_text(text) for text in (message_type, _SCHEMA_ENCODING, definition))
            schema = encode_record(Opcode.SCHEMA, UINT16.pack(len(self._schemas) + 1), *texts)
            self._schemas[message_type] = schema
            self._file.write(schema)
        numbers = UINT16.pack(len(self._channels)) + UINT16.pack(list(self._schemas).index(message_type) + 1)
        record = encode_record(
            Opcode.CHANNEL, numbers, encode_text(topic), encode_text(_MESSAGE_ENCODING), encode_texts(about)
        )
        self._file.write(record)
        self._channels.append(_Channel(record, []))
        self._counts.append(0)
        return len(self._channels) - 1

    def write(self, channel: int, time_ns: int, message: bytes) -> None:
        """Write a message."""
        self._counts[channel] += 1
        head = MESSAGE_HEAD.pack(channel, self._counts[channel], time_ns, time_ns)
        record = encode_record(Opcode.MESSAGE, head, message)
        self._channels[channel].places.append((time_ns, self._chunk_size))
        self._chunk.append(record)
        self._chunk_size += len(record)
        if self._chunk_size >= CHUNK_SIZE:
            self._finish_chunk()

    def finish(self) -> None:
        """Write the last chunk, the index and the end."""
        self._finish_chunk()
        self._file.write(encode_record(Opcode.DATA_END, UINT32.pack(0)))
        groups = {
            Opcode.SCHEMA: b''.join(self._schemas.values()),
            Opcode.CHANNEL: b''.join(channel.record for channel in self._channels),
            Opcode.STATISTICS: self._statistics(),
            Opcode.CHUNK_INDEX: b''.join(self._chunk_indexes),
        }
        summary_at, offsets = self._file.tell(), []
        for opcode, group in groups.items():
            if group:
                place = _SUMMARY_OFFSET.pack(opcode, self._file.tell(), len(group))
                offsets.append(encode_record(Opcode.SUMMARY_OFFSET, place))
                self._file.write(group)
        footer = encode_record(Opcode.FOOTER, FOOTER.pack(summary_at, self._file.tell(), 0))
        self._file.write(b''.join(offsets) + footer + MAGIC)

    def _finish_chunk(self) -> None:
        if not self._chunk:
            return
        times_ns = [time_ns for channel in self._channels for time_ns, _ in channel.places]
        first_ns, last_ns = min(times_ns), max(times_ns)
        self._first_ns = min(self._first_ns or first_ns, first_ns)
        self._last_ns = max(self._last_ns, last_ns)
        content, begin = b''.join(self._chunk), self._file.tell()
        size = UINT64.pack(len(content))
        head = CHUNK_HEAD.pack(first_ns, last_ns, len(content), zlib.crc32(content))
        self._file.write(encode_record(Opcode.CHUNK, head, _UNCOMPRESSED, size, content))
        end = self._file.tell()
        places = self._write_message_indexes()
        self._chunk_indexes.append(
            encode_record(
                Opcode.CHUNK_INDEX,
                struct.pack('<QQQQ', first_ns, last_ns, begin, end - begin),
                encode_list(places),
                UINT64.pack(self._file.tell() - end),
                _UNCOMPRESSED,
                size * 2,
            )
        )
        self._chunk, self._chunk_size = [], 0

    def _write_message_indexes(self) -> bytes:
        """Write where the chunk's messages are, and return where that stands, by channel."""
        indexes = []
        for number, channel in enumerate(self._channels):
            if channel.places:
                indexes.append(_CHANNEL_PLACE.pack(number, self._file.tell()))
                places = b''.join(_PLACE.pack(*place) for place in channel.places)
                self._file.write(encode_record(Opcode.MESSAGE_INDEX, UINT16.pack(number), encode_list(places)))
                channel.places.clear()
        return b''.join(indexes)

    def _statistics(self) -> bytes:
        counts = b''.join(_CHANNEL_PLACE.pack(number, count) for number, count in enumerate(self._counts))
        return encode_record(
            Opcode.STATISTICS,
            _COUNTS.pack(sum(self._counts), len(self._schemas), len(self._channels), 0, 0, len(self._chunk_indexes)),
            _PLACE.pack(self._first_ns, self._last_ns),
            encode_list(counts),
        )
