"""Files that are whole or absent, whatever is killed and whenever."""

from __future__ import annotations

import contextlib
import os
import uuid
from pathlib import Path
from typing import Union

UNFINISHED_SUFFIX = '.active'


def write_file(path: Union[str, Path], content: bytes) -> None:
    """Put a file in its place at one stroke; one of that name is replaced.

    Raises:
        OSError: it cannot be written; what was there before is still there. It names `path`.
    """
    path = Path(path)
    # A name of its own for each writer: two may write the same file at once, on two machines.
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
        with contextlib.suppress(OSError):  # in its place by now
            unfinished.unlink()
