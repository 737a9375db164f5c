"""numba's cache of machine code, shared by processes: one compiles a kernel, the others wait for its code.

And the code is taken for old when anything that it was made from has changed (base/compiled.py knows what): numba looks
at the kernel's own file alone.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import os
from typing import Any, Callable, Dict, Iterable, Iterator, Optional

from diff_encoder_sim.base.deferred import deferred

numba = deferred('numba')


def shared_cache(function: Callable[..., Any], sources: Iterable[str]) -> Any:
    """Return the cache for a dispatcher of `function`, in place of numba's own.

    Args:
        function: of the kernel.
        sources: what the machine code is made from; when it changes, the code is old.
    """
    cache = _shared_cache_type()(function)
    cache._cache_file._source_stamp = sorted(sources)
    return cache


@functools.lru_cache(maxsize=None)
def _shared_cache_type() -> Any:
    numbas: Any = numba.core.caching.FunctionCache

    class SharedCache(numbas):  # type: ignore[misc]
        """Between a miss and the code that is saved it is this process's turn to compile."""

        def __init__(self, function: Callable[..., Any]) -> None:
            super().__init__(function)
            self._turn: Optional[contextlib.ExitStack] = None

        def load_overload(self, signature: Any, target: Any) -> Any:
            found = super().load_overload(signature, target)
            if found is not None or self._turn is not None:
                return found
            self._turn = contextlib.ExitStack()
            self._turn.enter_context(only_process(self.cache_path))
            found = super().load_overload(signature, target)  # of a process whose turn it was
            if found is not None:
                self._end_turn()
            return found

        def save_overload(self, signature: Any, data: Any) -> None:
            try:
                super().save_overload(signature, data)
            finally:
                self._end_turn()

        def _end_turn(self) -> None:
            if self._turn is not None:
                self._turn.close()
                self._turn = None

    return SharedCache


# How often this process holds a folder: a kernel that is compiled may need another one of the same folder.
_held: Dict[str, int] = {}


@contextlib.contextmanager
def only_process(folder: str) -> Iterator[None]:
    """Keep other processes out of the same statement for a folder, where its file system can lock.

    The folder itself is locked, so that nothing is left there. Rooms that call each other's kernels do so in one
    direction (docs/architecture.md): no two processes wait for each other.
    """
    if _held.get(folder):
        _held[folder] += 1
        try:
            yield
        finally:
            _held[folder] -= 1
        return
    descriptor = _locked(folder)
    _held[folder] = 1
    try:
        yield
    finally:
        _held[folder] = 0
        if descriptor is not None:
            os.close(descriptor)


def _locked(folder: str) -> Optional[int]:
    """Wait for the lock of a folder; the descriptor holds it until it is closed."""
    try:
        os.makedirs(folder, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # no place for machine code either
        return None
    with contextlib.suppress(OSError):  # a file system without locks: then both compile
        fcntl.flock(descriptor, fcntl.LOCK_EX)
    return descriptor
