"""PyBullet, without the lines that it prints into tools' output and progress bars."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from typing import Iterator

# PyBullet's version decides which of the two the line goes to.
STDOUT, STDERR = 1, 2


@contextlib.contextmanager
def silence(*descriptors: int) -> Iterator[None]:
    """Silence file descriptors, as the line comes from C's printf, past sys.stdout."""
    sys.stdout.flush()
    sys.stderr.flush()
    flush_c = ctypes.CDLL(None).fflush
    flush_c(None)
    kept = [os.dup(descriptor) for descriptor in descriptors]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for descriptor in descriptors:
            os.dup2(nowhere, descriptor)
        yield
    finally:
        flush_c(None)
        for descriptor, copy in zip(descriptors, kept):
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(nowhere)


with silence(STDOUT, STDERR):
    import pybullet

__all__ = ['STDERR', 'STDOUT', 'pybullet', 'silence']
