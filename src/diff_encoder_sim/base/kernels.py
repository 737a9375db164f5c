"""`compiled`, the decorator of all numba kernels: `njit(cache=True)`, with numba imported at a kernel's first call.

numba's cache detects only changes in the file of a kernel. Kernels that call each other are therefore in one file,
with their constants (test/unit/base/test_kernels.py).
"""

from __future__ import annotations

import functools
import logging
import os
import stat
import tempfile
import threading
from pathlib import Path
from typing import Any, Callable, List, Optional, TypeVar, overload

import numpy as np

from diff_encoder_sim.base.deferred import deferred

numba = deferred('numba')

Function = TypeVar('Function', bound=Callable[..., Any])
Array = np.ndarray  # of a kernel's arguments; shapes are in the docstrings

log = logging.getLogger(__name__)
_LOCK = threading.RLock()
_CALLABLE: List[Callable[..., Any]] = []  # not passed to numba yet


class Kernel:
    """A function that numba compiles at its first call, from Python or from another compiled kernel."""

    def __init__(self, function: Callable[..., Any], options: Any) -> None:
        functools.update_wrapper(self, function)
        self._function, self._options = function, options
        self._dispatcher: Optional[Any] = None

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102 (that of the function)
        return (self._dispatcher or self.dispatcher)(*arguments)

    @property
    def dispatcher(self) -> Any:
        """Return numba's, which keeps machine code next to the source, in the user's cache, or in `_private_folder`."""
        with _LOCK:
            if self._dispatcher is None:
                _prepare_numba()
                while _CALLABLE:
                    numba.extending.register_jitable(_CALLABLE.pop())
                try:
                    self._dispatcher = numba.njit(self._function, cache=True, **self._options)
                except RuntimeError:  # neither the package nor the user's cache can be written
                    folder = _private_folder()
                    _set_cache_folder(folder or '')
                    if folder is None:
                        log.warning(
                            'compiled kernels (30 s) cannot be kept for other processes; NUMBA_CACHE_DIR names a folder'
                        )
                    self._dispatcher = numba.njit(self._function, cache=folder is not None, **self._options)
        return self._dispatcher

    def __getattr__(self, name: str) -> Any:
        # Interface that numba uses for called kernels: options and function.
        if name.startswith('__'):
            raise AttributeError(name)
        return getattr(self.dispatcher, name)


@overload
def compiled(kernel: Function) -> Function: ...


@overload
def compiled(**options: Any) -> Callable[[Function], Function]: ...


def compiled(*kernel: Any, **options: Any) -> Any:
    """Compile a kernel when it is first called, with `options` of numba.njit, and cache it if possible."""
    if kernel:
        return Kernel(kernel[0], options)
    return lambda function: Kernel(function, options)


def callable_by_kernels(function: Function) -> Function:
    """Make a Python function callable from kernels of its file, for scalars and arrays."""
    _CALLABLE.append(function)
    return function


@functools.lru_cache(maxsize=None)
def _prepare_numba() -> None:
    # Set before numba is imported, even if empty: otherwise a .numba_config.yaml in the current folder could select a
    # folder with machine code of another user.
    _set_cache_folder(os.environ.get('NUMBA_CACHE_DIR', ''))
    numba.extending.typeof_impl.register(Kernel)(lambda kernel, _context: numba.typeof(kernel.dispatcher))


def _set_cache_folder(folder: str) -> None:
    """Have numba use a folder for machine code, in this process and its children."""
    os.environ['NUMBA_CACHE_DIR'] = numba.config.CACHE_DIR = folder


def _private_folder() -> Optional[str]:
    """Return a folder in TMPDIR for machine code, of this user only, for a container with --user; None without it."""
    try:
        folder = Path(tempfile.gettempdir(), f'diff_encoder_sim-{os.geteuid()}')
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    is_private = stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o077
    return str(folder) if is_private else None
