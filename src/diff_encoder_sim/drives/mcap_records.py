"""The records of an MCAP file: an opcode, a length, and fields, of which texts and lists follow their length.

Format: https://mcap.dev/spec
"""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import Any, Dict, Iterator, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.wire import LENGTH, encode_text

MAGIC = b'\x89MCAP0\r\n'

RECORD_HEAD = struct.Struct('<BQ')  # opcode, length
MESSAGE_HEAD = struct.Struct('<HIQQ')  # channel, sequence, time of recording and of publishing [ns]
CHUNK_HEAD = struct.Struct('<QQQI')  # first and last time of recording [ns], size, CRC-32 of the records
FOOTER = struct.Struct('<QQI')  # where summary and its offsets begin, CRC-32


class Opcode(IntEnum):
    """What a record is; others exist, and are passed over."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def encode_record(opcode: Opcode, *fields: bytes) -> bytes:
    """Encode a record."""
    content = b''.join(fields)
    return RECORD_HEAD.pack(opcode, len(content)) + content


def encode_texts(texts: Dict[str, str]) -> bytes:
    """Encode a map of texts."""
    return encode_list(b''.join(encode_text(key) + encode_text(value) for key, value in texts.items()))


def encode_list(elements: bytes) -> bytes:
    """Encode a list or a map of encoded elements, which follow their length in bytes."""
    return LENGTH.pack(len(elements)) + elements


def records(content: bytes) -> Iterator[Tuple[int, int, int]]:
    """Find the whole records of a chunk: opcode, where the fields begin, and where they end.

    Raises:
        InputFault: an opcode is 0, as where a disk has zeros.
    """
    at, last = 0, len(content) - RECORD_HEAD.size
    while at <= last:
        opcode, length = RECORD_HEAD.unpack_from(content, at)
        if not opcode:
            raise InputFault(f'has no opcode at byte {at} of its content')
        begin = at + RECORD_HEAD.size
        at = begin + length
        if at > len(content):
            return
        yield opcode, begin, at


class RecordFields:
    """The fields of a record, each read once and in their order; InputFault where the record is torn."""

    def __init__(self, content: bytes) -> None:
        self._content, self._at = content, 0

    def unpack(self, fields: struct.Struct) -> Tuple[Any, ...]:
        """Read numbers."""
        return fields.unpack(self.content(fields.size))

    def text(self) -> str:
        """Read a text."""
        length: int = self.unpack(LENGTH)[0]
        return self.content(length).decode('utf-8', 'replace')

    def content(self, size: int) -> bytes:
        """Read bytes."""
        begin, self._at = self._at, self._at + size
        if self._at > len(self._content):
            raise InputFault('is torn')
        return self._content[begin : self._at]
