"""PyBullet, imported without the line that it prints: tools print results where that line goes."""
from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from typing import Iterator


@contextlib.contextmanager
def _silent_stdout() -> Iterator[None]:
    """Of C as well: the line comes from printf, which sys.stdout knows nothing of."""
    sys.stdout.flush()
    flush_c = ctypes.CDLL(None).fflush
    flush_c(None)
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        flush_c(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


with _silent_stdout():
    import pybullet  # noqa: F401  (what this module is for)
