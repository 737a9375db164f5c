"""Reads a serialized message field by field."""

from __future__ import annotations

import struct
from typing import Any, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import LATEST_NS, NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.primitives import LENGTH, TIME, UINT32

TORN = 'a message is torn'

# A header begins with its stamp and its frame, after four bytes: ROS 1's seq or CDR's representation.
STAMP_AT, FRAME_AT = 4, 12

_CDR_BEGIN = 4
_LITTLE_ENDIAN_CDR = b'\1'


class FieldReader:
    """The fields of a message, each read once and in their order; InputFault where the message is torn.

    ROS 1 and ROS 2 (CDR) differ in the first bytes, in the end of texts, and in alignment.
    """

    def __init__(self, raw: bytes, is_cdr: bool) -> None:
        if is_cdr and raw[1:2] != _LITTLE_ENDIAN_CDR:
            raise InputFault('a message is not little-endian CDR')
        self._raw, self._is_cdr = raw, is_cdr
        self._at = _CDR_BEGIN if is_cdr else 0

    def align(self, size: int) -> int:
        """Return where the next field begins, which is made of numbers of `size` bytes."""
        if self._is_cdr:
            self._at += -(self._at - _CDR_BEGIN) % size  # counted from after its four bytes
        return self._at

    def unpack(self, fields: struct.Struct, number_size: int) -> Tuple[Any, ...]:
        """Read numbers of `number_size` bytes each."""
        begin = self.align(number_size)
        try:
            numbers = fields.unpack_from(self._raw, begin)
        except struct.error:
            raise InputFault(TORN) from None
        self._at = begin + fields.size
        return numbers

    def length(self) -> int:
        """Read the length of the text or sequence that follows."""
        length: int = self.unpack(LENGTH, LENGTH.size)[0]
        return length

    def content(self, size: int) -> bytes:
        """Read bytes."""
        begin, self._at = self._at, self._at + size
        if self._at > len(self._raw):
            raise InputFault(TORN)
        return self._raw[begin : self._at]

    def text(self, errors: str = 'replace') -> str:
        """Read a string; `errors` says what becomes of bytes that are not UTF-8, as for `bytes.decode`."""
        content = self.content(self.length())
        return content[: len(content) - self._is_cdr].decode('utf-8', errors)  # less CDR's NUL

    def header(self) -> Tuple[int, str]:
        """Read stamp [ns] and frame; InputFault if the nanoseconds lead beyond the latest stamp."""
        if not self._is_cdr:
            self.unpack(UINT32, UINT32.size)  # seq
        seconds, nanoseconds = self.unpack(TIME, UINT32.size)
        stamp_ns = seconds * NANOSECONDS_PER_SECOND + nanoseconds
        if stamp_ns >= LATEST_NS:
            raise InputFault('a stamp is not before 2^32 s')
        return stamp_ns, self.text()
