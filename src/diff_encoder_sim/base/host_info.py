"""Provenance of results: the host's processor, and git for the commit of a checkout."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path
from typing import Optional


def cpu_model() -> str:
    """Return the processor's name, or its architecture where Linux does not report one."""
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.split(':', 1)[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.machine()


def usable_cores() -> int:
    """Return how many cores this process may use, which can be fewer than the host has."""
    return len(os.sched_getaffinity(0))


def git(folder: Path, *arguments: str) -> Optional[str]:
    """Return the output of a git command in a folder; None where it fails or git is missing."""
    try:
        completed = subprocess.run(
            ['git', '-C', str(folder), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            check=True,
            timeout=10,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return completed.stdout.decode('utf-8', 'replace').strip()
