"""Python's search for objects that refer to each other in circles, which takes a twentieth of a trial's time."""

from __future__ import annotations

import contextlib
import gc
from typing import Iterator


@contextlib.contextmanager
def without_collection() -> Iterator[None]:
    """Have no such search within a with statement that leaves few circles behind; the next ones find these."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
