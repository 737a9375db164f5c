"""numba's cache of machine code, shared by processes: one compiles a kernel, the others wait for its code.

It differs from numba's own where that would run old code or end the program. Code is old when anything that it was made
from has changed (base/compiled.py knows what), and never has the name of newer code. What cannot be read is compiled
again; what cannot be written is not kept, which is said. The lock saves work, no more: nobody waits long for it.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import glob
import hashlib
import logging
import os
import time
import uuid
from typing import IO, Any, Dict, Iterable, Iterator, Optional

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.machine_code import say_once

numba = deferred('numba')

PATIENCE_S = 60.0  # with a process that compiles the same kernel; the longest takes half a minute
POLL_S = 0.05

log = logging.getLogger(__name__)


def keep_code(dispatcher: Any, sources: Iterable[str]) -> None:
    """Let a dispatcher of numba use the cache, in place of numba's own, where code can be kept.

    Args:
        dispatcher: of the kernel.
        sources: what the machine code is made from; when it changes, the code is old.
    """
    stamp = hashlib.sha256('\n'.join(sorted(sources)).encode()).hexdigest()
    try:
        cache = _shared_cache_type()(dispatcher.py_func, stamp)
    except (OSError, RuntimeError) as error:  # numba found no folder, or no file of the source
        _say_not_kept(os.path.dirname(dispatcher.py_func.__code__.co_filename), str(error))
        return
    compile_of_numba, numbas_lock = dispatcher.compile, numba.core.compiler_lock.global_compiler_lock

    def compile_in_turn(signature: Any) -> Any:
        with numbas_lock, cache.turn():  # of threads, which share a turn; and of processes
            return compile_of_numba(signature)

    dispatcher._cache, dispatcher.compile = cache, compile_in_turn


@functools.lru_cache(maxsize=None)
def _shared_cache_type() -> Any:
    numbas: Any = numba.core.caching.FunctionCache

    class SharedCache(numbas):  # type: ignore[misc]
        """Between a miss and the end of compiling it is this process's turn to compile."""

        def __init__(self, function: Any, stamp: str) -> None:
            super().__init__(function)
            stem = self._impl.filename_base
            self._cache_file = _code_files_type()(self.cache_path, stem, stamp)
            self._lock_path = os.path.join(self.cache_path, f'{stem}.lock')
            self._lock: Optional[IO[bytes]] = None

        def load_overload(self, signature: Any, target: Any) -> Any:
            found = super().load_overload(signature, target)
            if found is None and self._lock is None:
                self._lock = _locked(self._lock_path)
                found = super().load_overload(signature, target)  # of a process whose turn it was
            return found

        def _load_overload(self, signature: Any, target: Any) -> Any:
            try:
                return super()._load_overload(signature, target)
            except Exception:  # torn files can raise anything; the code is compiled, and replaces them
                log.debug('cannot use the code of %s in %s', self._name, self.cache_path, exc_info=True)
                return None

        def _save_overload(self, signature: Any, data: Any) -> None:
            try:
                super()._save_overload(signature, data)
            except OSError as error:
                _say_not_kept(self.cache_path, error.strerror or str(error))

        @contextlib.contextmanager
        def turn(self) -> Iterator[None]:
            try:
                yield
            finally:  # also where compiling raises, which saves nothing
                if self._lock is not None:
                    _unlock(self._lock)
                    self._lock = None

    return SharedCache


@functools.lru_cache(maxsize=None)
def _code_files_type() -> Any:
    numbas: Any = numba.core.caching.IndexDataCacheFile

    class CodeFiles(numbas):  # type: ignore[misc]
        """An index, and files with code. Of these each has a name of its own.

        numba writes the index first, and uses names again: when it is killed in between, the index of new code names
        a file with old code.
        """

        def save(self, key: Any, data: Any) -> None:
            name = self._data_name_pattern.format(number=uuid.uuid4().int)
            try:
                self._save_data(name, data)
                self._save_index({**self._load_index(), key: name})
            finally:
                self._remove_what_has_no_index()

        def _load_index(self) -> Dict[Any, str]:
            try:
                return dict(super()._load_index())
            except Exception:  # as above
                return {}

        def _remove_what_has_no_index(self) -> None:
            named = set(self._load_index().values())
            before, after = map(glob.escape, self._data_path(self._data_name_pattern).split('{number:d}'))
            for path in glob.glob(f'{before}*{after}'):
                if os.path.basename(path) not in named:
                    with contextlib.suppress(OSError):  # another process was faster
                        os.unlink(path)

    return CodeFiles


def _say_not_kept(folder: str, reason: str) -> None:
    say_once('%s: compiled kernels cannot be kept, each process compiles them anew: %s', folder, reason)


def _locked(path: str) -> Optional[IO[bytes]]:
    """Return a file that is locked until _unlock(); None where there are no locks, or another process is too slow."""
    try:
        file = open(path, 'ab')  # noqa: SIM115 (for writing: NFS locks no other)
    except OSError:  # where code cannot be kept either
        return None
    if _is_locked_in_time(file):
        return file
    file.close()
    return None


def _is_locked_in_time(file: IO[bytes]) -> bool:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(POLL_S)
        except OSError:  # a file system without locks
            return False
    log.warning('%s: another process has compiled this kernel for %.0f s: no longer waiting', file.name, PATIENCE_S)
    return False


def _unlock(file: IO[bytes]) -> None:
    """End a lock. Who waits for it gets the file that is removed here, and finds the code that it waited for."""
    with contextlib.suppress(OSError):
        os.unlink(file.name)
    with file:
        fcntl.flock(file, fcntl.LOCK_UN)  # of processes that were forked meanwhile, too
