"""`compiled`, the decorator of all numba kernels: `njit(cache=True)`, with numba imported at a kernel's first call.

numba's cache detects only changes in the file of a kernel. Kernels that call each other are therefore in one file,
with their constants (test/unit/base/test_kernels.py).
"""

from __future__ import annotations

import functools
import logging
import os
import threading
from pathlib import Path
from typing import Any, Callable, List, Optional, TypeVar, overload

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.own_folder import own_folder

numba = deferred('numba')

FOLDER_VARIABLE = 'NUMBA_CACHE_DIR'
PACKAGE = Path(os.path.abspath(__file__)).parents[1]
Function = TypeVar('Function', bound=Callable[..., Any])
Array = np.ndarray  # of a kernel's arguments; shapes are in the docstrings

log = logging.getLogger(__name__)
_LOCK = threading.RLock()


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
        """Return numba's."""
        with _LOCK:
            if self._dispatcher is None:
                is_kept = _prepare_numba()
                while _CALLABLE:
                    numba.extending.register_jitable(_CALLABLE.pop())
                self._dispatcher = numba.njit(self._function, cache=is_kept, **self._options)
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


_CALLABLE: List[Callable[..., Any]] = []  # not passed to numba yet


def callable_by_kernels(function: Function) -> Function:
    """Make a Python function callable from kernels of its file, for scalars and arrays."""
    _CALLABLE.append(function)
    return function


def cache_folder() -> Optional[str]:
    """Return the folder for machine code: '' for __pycache__ next to the source, None if no folder can be written."""
    given = os.environ.get(FOLDER_VARIABLE)
    if given:
        return given
    if all(_is_writable(room.parent) for room in PACKAGE.glob('*/__init__.py')):
        return ''
    own = own_folder()
    return None if own is None else str(own / 'kernels')


def _is_writable(room: Path) -> bool:
    cache = room / '__pycache__'
    return os.access(str(cache if cache.exists() else room), os.W_OK | os.X_OK)


@functools.lru_cache(maxsize=None)
def _prepare_numba() -> bool:
    """Select the cache folder for this process and its children; return whether machine code is cached."""
    folder = cache_folder()
    if folder is None:
        log.warning('%s: no folder for compiled kernels can be written; each process compiles them (30 s)', PACKAGE)
    # Set before numba is imported, even if empty: otherwise a .numba_config.yaml in the current folder could select a
    # folder with machine code of another user.
    os.environ[FOLDER_VARIABLE] = folder or ''
    numba.config.CACHE_DIR = folder or ''

    def type_of_kernel(kernel: Kernel, context: Any) -> Any:
        del context
        return numba.typeof(kernel.dispatcher)

    numba.extending.typeof_impl.register(Kernel)(type_of_kernel)
    return folder is not None
