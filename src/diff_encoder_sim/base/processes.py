"""The process and its host."""

from __future__ import annotations

import contextlib
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path
from typing import Iterator, List, Optional


@contextlib.contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block SIGINT: permanently in threads and processes started in this context, here until its end."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def python_command(module: str) -> List[str]:
    """Return the command that runs `main` of a module below diff_encoder_sim with the sys.path of this process.

    `python -m` would import from the current folder, which another user may own, before the libraries.
    """
    code = f'import sys; sys.path[:] = {sys.path!r}; from diff_encoder_sim.{module} import main; main()'
    return [sys.executable, '-c', code]


# Options with which roslaunch does not start nodes.
LISTING_OPTIONS = (b'--nodes', b'--files', b'--find-node', b'--args', b'--dump-params')


def is_roslaunch(pid: int) -> bool:
    """Return whether a process is a roslaunch; False if it does not exist."""
    return any(b'roslaunch' in word for word in _command_line(pid))


def parent_only_lists() -> bool:
    """Return whether this process was started by a roslaunch that only lists nodes or files."""
    parent = os.getppid()
    return is_roslaunch(parent) and any(word.startswith(LISTING_OPTIONS) for word in _command_line(parent))


def catches_signal(pid: int, number: int) -> bool:
    """Return whether a process has a handler for a signal; True if it does not exist."""
    try:
        status = Path(f'/proc/{pid}/status').read_text()
    except OSError:
        return True
    caught = next(line.split()[1] for line in status.splitlines() if line.startswith('SigCgt:'))
    return bool(int(caught, 16) >> (number - 1) & 1)


def _command_line(pid: int) -> List[bytes]:
    try:
        return Path(f'/proc/{pid}/cmdline').read_bytes().split(b'\0')
    except OSError:
        return []


def cpu_model() -> str:
    """Return the processor's name, or its architecture if Linux does not report one."""
    lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    names = (line.split(':', 1)[1].strip() for line in lines if line.startswith('model name'))
    return next(names, platform.machine())


def usable_cores() -> int:
    """Return the number of cores available to this process."""
    return len(os.sched_getaffinity(0))


def git(folder: Path, *arguments: str) -> Optional[str]:
    """Return the output of a git command in a folder; None if it fails or git is missing."""
    try:
        command = ['git', '-C', str(folder), *arguments]
        return subprocess.check_output(command, stderr=subprocess.DEVNULL, encoding='utf-8', timeout=10).strip()
    except (OSError, subprocess.SubprocessError):
        return None
