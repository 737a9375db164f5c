"""Finds the package in this checkout, and says what a table was measured on."""
from __future__ import annotations

import importlib.util
import os
import platform
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# With the workspace sourced the package comes through catkin: leave that be.
if importlib.util.find_spec('diff_encoder_sim') is None:
    sys.path.insert(0, str(ROOT / 'src'))


def print_header(title: str) -> None:
    """Title, machine, python and commit: a number without them cannot be compared."""
    load = ', '.join(f'{value:.1f}' for value in os.getloadavg())
    print(title)
    print(f'machine: {_processor()}, {os.cpu_count()} cores, {platform.system()} '
          f'{platform.release()}; load average {load}')
    print(f'python:  {platform.python_version()}')
    print(f'commit:  {_commit()}')
    print(flush=True)


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines()
    except OSError:
        lines = []
    names = [line.split(':', 1)[1].strip() for line in lines if line.startswith('model name')]
    return names[0] if names else platform.machine()


def _commit() -> str:
    commit = _git('rev-parse', '--short', 'HEAD')
    if not commit:
        return 'not a git checkout'
    return f'{commit} with changes' if _git('status', '--porcelain', 'src', 'urdf') else commit


def _git(*arguments: str) -> str:
    done = subprocess.run(['git', '-C', str(ROOT), *arguments], stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, check=False)
    return done.stdout.decode().strip()
