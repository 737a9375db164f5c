"""Atomic file writes: files are complete or absent, even if the process is killed."""

from __future__ import annotations

import os
import uuid
from pathlib import Path
from typing import Union

UNFINISHED_SUFFIX = '.active'

# In bytes; leaves room for the suffixes of unfinished files.
LONGEST_NEW_NAME = 200


def write_file(path: Union[str, Path], content: bytes) -> None:
    """Write or replace a file atomically. OSError, which names `path`, if it cannot be written: the old file stays."""
    path = Path(path)
    # A unique name per writer: two hosts may write the same file at once.
    unfinished = path.with_name(f'.{path.name}.{uuid.uuid4().hex}{UNFINISHED_SUFFIX}')
    try:
        with open(unfinished, 'wb') as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)
    except OSError as error:
        if unfinished.exists():
            unfinished.unlink()
        raise OSError(error.errno, error.strerror, str(path)) from None
