"""What processes started by roslaunch can learn about it from /proc."""

from __future__ import annotations

import os
from pathlib import Path
from typing import List

# Options of roslaunch that start nothing.
LISTING_OPTIONS = (b'--nodes', b'--files', b'--find-node', b'--args', b'--dump-params')


def is_roslaunch(pid: int) -> bool:
    """Return whether a process is a roslaunch; False where there is no such process."""
    return any(b'roslaunch' in word for word in _command_line(pid))


def parent_only_lists() -> bool:
    """Return whether this process was started by a roslaunch that lists nodes or files, and starts nothing."""
    parent = os.getppid()
    return is_roslaunch(parent) and any(word.startswith(LISTING_OPTIONS) for word in _command_line(parent))


def catches_signal(pid: int, number: int) -> bool:
    """Return whether a process has a handler for a signal; True if there is no such process."""
    try:
        status = Path(f'/proc/{pid}/status').read_text()
    except OSError:
        return True
    caught = next((line.split()[1] for line in status.splitlines() if line.startswith('SigCgt:')), '')
    return bool(int(caught or 'f' * 16, 16) >> (number - 1) & 1)


def _command_line(pid: int) -> List[bytes]:
    try:
        return Path(f'/proc/{pid}/cmdline').read_bytes().split(b'\0')
    except OSError:
        return []
