"""A folder of the user's own for what is worth keeping: in the user's cache, or where there is none in /tmp."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import Iterator, Optional

NAME = 'diff_encoder_sim'


def own_folder() -> Optional[Path]:
    """Return a folder that this user, and no other one, can write; None where there cannot be one.

    What is read back from it may be code. Anybody may make a folder in /tmp: one of somebody else's is not taken.
    """
    return next((folder for folder in _candidates() if _is_own(folder)), None)


def _candidates() -> Iterator[Path]:
    cache = os.environ.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')
    if os.path.isabs(cache):  # not without HOME and account
        yield Path(cache, NAME)
    try:
        yield Path(tempfile.gettempdir(), f'{NAME}-{os.geteuid()}')
    except OSError:
        return  # no folder for temporary files: a container whose root is read-only


def _is_own(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    is_private = stat.S_ISDIR(status.st_mode) and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return is_private and status.st_uid == os.geteuid() and os.access(folder, os.W_OK | os.X_OK)
