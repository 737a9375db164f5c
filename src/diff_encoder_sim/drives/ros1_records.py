"""The records of a ROS 1 bag: a header of named fields, and data, each after its length.

Format: http://wiki.ros.org/Bags/Format/2.0
"""

from __future__ import annotations

from typing import BinaryIO, Dict, Iterator, Optional, Tuple

from diff_encoder_sim.drives.wire import LENGTH

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
