"""Decompresses chunks and messages of bags to no more than they may become: 5 kB of bz2 can be 2 GB."""

from __future__ import annotations

import bz2
import contextlib
import importlib
import io
from typing import BinaryIO, Callable, Dict, cast

import lz4.frame

from diff_encoder_sim.base.errors import InputFault, in_one_line

# Of a chunk, or of a message that is compressed separately [bytes]. Recorders close a chunk at 1 to 4 MiB; it is
# larger only if one message is.
LARGEST_CHUNK = 1 << 27

# Of all compressed chunks or messages of a file together [bytes]. Drives become two to twenty times as large, maps of
# free space a hundred times.
LARGEST_SUM = 1 << 28
LARGEST_RATIO = 256


def _zstd_reader() -> Callable[[BinaryIO], BinaryIO]:
    """Return a reader of zstd: Python's own from 3.14, or that of the library which rosbags requires."""
    for name in ('compression.zstd', 'backports.zstd'):
        with contextlib.suppress(ImportError):
            return cast('Callable[[BinaryIO], BinaryIO]', importlib.import_module(name).ZstdFile)
    library = importlib.import_module('zstandard')
    return cast('Callable[[BinaryIO], BinaryIO]', library.ZstdDecompressor().stream_reader)


open_zstd = _zstd_reader()  # returns the decompressed content of a file, which is decompressed as it is read

# Each returns no more than the first `size` bytes, and needs little more memory.
_BEGINNINGS: Dict[str, Callable[[bytes, int], bytes]] = {
    'bz2': lambda data, size: bz2.BZ2Decompressor().decompress(data, max_length=size),
    'lz4': lambda data, size: bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size)),
    'zstd': lambda data, size: open_zstd(io.BytesIO(data)).read(size),
}


def decompressed(compression: str, data: bytes, size: int = LARGEST_CHUNK) -> bytes:
    """Decompress a chunk or a message as far as it goes: bz2 and lz4 accept a missing end.

    Args:
        compression: 'bz2', 'lz4', 'zstd', or 'none' or '' for data as they are.
        data: compressed.
        size: that its header gives [bytes].

    Raises:
        InputFault: the size is above `LARGEST_CHUNK`, it becomes larger than that, or is damaged.
    """
    check_size(size)
    if compression in ('', 'none'):
        return data
    if compression not in _BEGINNINGS:
        raise InputFault(f'compressed by {compression!r}; expected {", ".join(_BEGINNINGS)} or none')
    try:
        content = _BEGINNINGS[compression](data, size + 1)
    except Exception as error:  # each library has its own, down to RuntimeError
        raise InputFault(f'cannot be decompressed: {in_one_line(error)}') from None
    if len(content) > size:
        raise InputFault(f'becomes larger than the {size} bytes that it says')
    return content


class BoundedSum:
    """Decompresses the chunks or messages of one file, up to a bound on the sum of their sizes."""

    def __init__(self, file_bytes: int) -> None:
        """Set the bound by the size of the file."""
        self.bound = LARGEST_SUM + LARGEST_RATIO * file_bytes
        self._sum = 0

    def decompressed(self, compression: str, data: bytes, size: int = LARGEST_CHUNK) -> bytes:
        """Decompress as the function `decompressed` does.

        Raises:
            InputFault: as `decompressed`, or the sum exceeds its bound.
        """
        if self._sum > self.bound:
            raise InputFault(f'is left out: all before it became {self._sum} bytes; allowed: at most {self.bound}')
        became = size
        try:
            content = decompressed(compression, data, size)
            became = len(content) if content is not data else 0
        finally:
            self._sum += became
        return content


def check_size(size: int) -> None:
    """Check the size that a chunk's header gives, before anything is read.

    Raises:
        InputFault: larger than `LARGEST_CHUNK`.
    """
    if size > LARGEST_CHUNK:
        raise InputFault(f'says that it has {size} bytes; allowed: at most {LARGEST_CHUNK}')
