"""PyBullet, without the lines that it prints into tools' output and progress bars.

It is imported when it is first used. Where it is not installed, all that does not simulate works, and what does ends
with one line.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
from typing import Any, Iterator

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError

# PyBullet's version decides which of the two the line goes to.
STDOUT, STDERR = 1, 2


@contextlib.contextmanager
def silence(*descriptors: int) -> Iterator[None]:
    """Silence file descriptors, as the line comes from C's printf, past sys.stdout."""
    sys.stdout.flush()
    sys.stderr.flush()
    flush_c = ctypes.CDLL(None).fflush
    flush_c(None)
    kept = [os.dup(descriptor) for descriptor in descriptors]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for descriptor in descriptors:
            os.dup2(nowhere, descriptor)
        yield
    finally:
        flush_c(None)
        for descriptor, copy in zip(descriptors, kept):
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(nowhere)


def _import_quietly(name: str) -> Any:
    try:
        with silence(STDOUT, STDERR):
            return importlib.import_module(name)
    except ModuleNotFoundError:
        raise ConfigError(
            'PyBullet, which simulates the robot, is not installed; allowed: pip install pybullet (a minute on Python '
            '3.8 to 3.11, which have wheels; newer ones build it from source, with a C++ compiler in ten minutes, as '
            'the extra [sim] does)'
        ) from None


pybullet = deferred('pybullet', _import_quietly)

__all__ = ['STDERR', 'STDOUT', 'pybullet', 'silence']
