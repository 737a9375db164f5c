"""Finds the package in this checkout, and says what a table was measured on."""

from __future__ import annotations

import importlib.util
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple, Tuple

ROOT = Path(__file__).resolve().parents[2]

# With the workspace sourced the package comes through catkin: leave that be.
if importlib.util.find_spec('diff_encoder_sim') is None:
    sys.path.insert(0, str(ROOT / 'src'))

from diff_encoder_sim.base.processes import cpu_model, git  # noqa: E402 (found by the lines above)


class MeasuredOn(NamedTuple):
    """What a number without cannot be compared."""

    host: str
    python: str
    commit: str


def measured_on() -> MeasuredOn:
    """Return what this process measures on."""
    host = f'{cpu_model()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}'
    return MeasuredOn(host, platform.python_version(), _commit())


def print_header(title: str) -> None:
    """Print title, machine, python and commit."""
    on = measured_on()
    load = ', '.join(f'{value:.1f}' for value in os.getloadavg())
    print(title)
    print(f'machine: {on.host}; load average {load}')
    print(f'python:  {on.python}')
    print(f'commit:  {on.commit}')
    print(flush=True)


def first_call_s(benchmark: str, function: str) -> Tuple[float, float]:
    """What a benchmark's function returns in a new process: compiling, then with what was compiled."""
    code = f'import {benchmark}; print({benchmark}.{function}())'
    with tempfile.TemporaryDirectory() as cache:
        outputs = [
            subprocess.run(
                [sys.executable, '-c', code],
                stdout=subprocess.PIPE,
                check=True,
                cwd=str(Path(__file__).parent),
                env={**os.environ, 'NUMBA_CACHE_DIR': cache},
            ).stdout
            for _ in range(2)
        ]
    compiling_s, compiled_s = (float(output.split()[-1]) for output in outputs)  # PyBullet greets first
    return compiling_s, compiled_s


def _commit() -> str:
    commit = git(ROOT, 'rev-parse', '--short', 'HEAD')
    if not commit:
        return 'not a git checkout'
    return f'{commit} with changes' if git(ROOT, 'status', '--porcelain', 'src', 'urdf') else commit
