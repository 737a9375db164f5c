"""Reads an MCAP file of ROS 2 from its beginning to its end, as `Ros1Stream` does a bag of ROS 1.

Needs no index either, and decompresses no chunk to more than it says (docs/adr/0023-bags-in-and-out.md).
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path
from typing import BinaryIO, Collection, Dict, Iterator, List, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import LATEST_NS
from diff_encoder_sim.drives.bag_messages import BagConnection, Message
from diff_encoder_sim.drives.bounded_decompression import BoundedSum, check_size
from diff_encoder_sim.drives.mcap_records import (
    CHUNK_HEAD,
    FOOTER,
    MAGIC,
    MESSAGE_HEAD,
    RECORD_HEAD,
    Opcode,
    RecordFields,
    records,
)
from diff_encoder_sim.drives.wire import UINT16, UINT64

_CDR = 'cdr'
_FOOTER_SIZE = RECORD_HEAD.size + FOOTER.size + len(MAGIC)
_READ = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK)


class McapStream:
    """The topics of a file, and its messages, as often as they are asked for."""

    is_cdr = True

    def __init__(self, path: Path) -> None:
        """Read the topics.

        Args:
            path: of a file that begins with `MAGIC`.

        Raises:
            OSError: it cannot be read.
        """
        self._path = path
        self._types: Dict[int, str] = {}  # by schema
        self._topic_of: Dict[int, str] = {}  # by channel
        self.topics: Dict[str, str] = {}  # types by topic
        self.definitions: Dict[str, str] = {}  # by type, as recorded; empty where they were not
        self.fault = ''  # why not all of it can be read
        with open(path, 'rb') as file:
            is_indexed = self._read_summary(file)
        if not is_indexed:
            self.fault = 'no index, as after a crash'
            for _ in self.messages(()):
                pass  # learns every channel on the way

    @property
    def connections(self) -> List[BagConnection]:
        """Return the topics in the order of the file."""
        return [BagConnection(*topic) for topic in self.topics.items()]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics as they were written.

        Raises:
            OSError: the file cannot be read.
        """
        with open(self._path, 'rb') as file:
            total = BoundedSum(os.fstat(file.fileno()).st_size)
            for opcode, content in self._records(file, len(MAGIC)):
                if opcode != Opcode.CHUNK:
                    yield from self._take(opcode, content, topics)
                    continue
                at = file.tell() - len(content)
                try:
                    chunk = _decompressed(content, total)
                    for inner, begin, end in records(chunk):
                        if inner in _READ:
                            yield from self._take(inner, chunk[begin:end], topics)
                except InputFault as fault:
                    self.fault = f'damaged: the chunk at byte {at} {fault}'

    def _read_summary(self, file: BinaryIO) -> bool:
        """Learn the channels where the file lists them, and return whether it does."""
        size = os.fstat(file.fileno()).st_size
        file.seek(max(size - _FOOTER_SIZE, 0))
        ending = file.read()
        if len(ending) < _FOOTER_SIZE or not ending.endswith(MAGIC) or ending[0] != Opcode.FOOTER:
            return False
        begin = FOOTER.unpack_from(ending, RECORD_HEAD.size)[0]
        if not 0 < begin < size:
            return False
        for opcode, content in self._records(file, begin):
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._learn(opcode, content)
        return bool(self.topics)

    def _records(self, file: BinaryIO, begin: int) -> Iterator[Tuple[int, bytes]]:
        """Yield opcode and fields of what is read, from a place in the file to its end, or to where it is torn."""
        size = os.fstat(file.fileno()).st_size
        file.seek(begin)
        while file.tell() < size:
            at = file.tell()
            head = file.read(RECORD_HEAD.size)
            opcode, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, size)
            ends_at = at + RECORD_HEAD.size + length
            if not opcode and len(head) == RECORD_HEAD.size:
                self.fault = f'damaged: no opcode at byte {at}'
                return
            if opcode == Opcode.FOOTER:
                return
            if ends_at > size:
                self.fault = f'torn at byte {at}'
                return
            if opcode in _READ:
                try:
                    check_size(length)
                except InputFault as fault:
                    self.fault = f'damaged: the record at byte {at} {fault}'
                else:
                    yield opcode, file.read(length)
            file.seek(ends_at)

    def _take(self, opcode: int, content: bytes, topics: Collection[str]) -> Iterator[Message]:
        if opcode != Opcode.MESSAGE:
            self._learn(opcode, content)
        elif len(content) >= MESSAGE_HEAD.size:
            channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(content)
            topic = self._topic_of.get(channel)
            if time_ns >= LATEST_NS:
                self.fault = f'damaged: a message on {topic} has no time before 2^32 s'
            elif topic in topics and topic is not None:
                yield Message(topic, time_ns, content[MESSAGE_HEAD.size :])

    def _learn(self, opcode: int, content: bytes) -> None:
        fields = RecordFields(content)
        try:
            number: int = fields.unpack(UINT16)[0]
            if opcode == Opcode.SCHEMA:
                kind, _, definition = fields.text(), fields.text(), fields.text()
                self._types[number] = kind
                self.definitions.setdefault(kind, definition)
                return
            schema, topic, encoding = fields.unpack(UINT16)[0], fields.text(), fields.text()
        except InputFault as fault:
            self.fault = f'damaged: a description of a topic {fault}'
            return
        if encoding == _CDR and schema in self._types:
            self._topic_of[number] = topic
            self.topics.setdefault(topic, self._types[schema])
        else:
            self.fault = f'{topic} is left out: encoded as {encoding!r}; expected {_CDR!r}'


def _decompressed(content: bytes, total: BoundedSum) -> bytes:
    fields = RecordFields(content)
    _, _, said, checksum = fields.unpack(CHUNK_HEAD)
    compression = fields.text()
    chunk = total.decompressed(compression, fields.content(fields.unpack(UINT64)[0]), said)
    if checksum not in (0, zlib.crc32(chunk)):
        raise InputFault('does not have its checksum')
    return chunk
