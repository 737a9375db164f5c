"""A private cache folder: in the user's cache, or in /tmp if there is none."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path
from typing import Iterator, Optional

NAME = 'diff_encoder_sim'


def own_folder() -> Optional[Path]:
    """Return a folder that only this user can write; None if it cannot be created.

    Its files may be code; a folder of another user in /tmp is therefore rejected.
    """
    return next((folder for folder in _candidates() if _is_own(folder)), None)


def _candidates() -> Iterator[Path]:
    cache = os.environ.get('XDG_CACHE_HOME') or os.path.expanduser('~/.cache')
    if os.path.isabs(cache):  # not without HOME and account
        yield Path(cache, NAME)
    try:
        yield Path(tempfile.gettempdir(), f'{NAME}-{os.geteuid()}')
    except OSError:
        return  # no temporary folder, as in a container with a read-only root


def _is_own(folder: Path) -> bool:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    is_private = stat.S_ISDIR(status.st_mode) and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return is_private and status.st_uid == os.geteuid() and os.access(folder, os.W_OK | os.X_OK)
