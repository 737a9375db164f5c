"""Files that are either complete or absent, whenever the process is killed."""

from __future__ import annotations

import contextlib
import os
import uuid
from pathlib import Path
from typing import Union

UNFINISHED_SUFFIX = '.active'

# In bytes, with a suffix and the parts that the names of unfinished files have in addition.
LONGEST_NEW_NAME = 200


def write_file(path: Union[str, Path], content: bytes) -> None:
    """Write a file atomically, in place of one of that name.

    Raises:
        OSError: it cannot be written, and what was there before is unchanged; the error names `path`.
    """
    path = Path(path)
    # A name of its own for each writer: two may write the same file at once, on two hosts.
    unfinished = path.with_name(f'.{path.name}.{uuid.uuid4().hex}{UNFINISHED_SUFFIX}')
    try:
        with open(unfinished, 'wb') as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(unfinished, path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with contextlib.suppress(OSError):  # renamed by now
            unfinished.unlink()
