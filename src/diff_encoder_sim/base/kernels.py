"""`compiled`, the decorator of all numba kernels: `njit(cache=True)`, with numba imported at a kernel's first call.

numba's cache detects only changes in the file of a kernel. Kernels that call each other are therefore in one file,
with their constants (test/unit/base/test_kernels.py).
"""

from __future__ import annotations

import functools
import logging
import os
import threading
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
        """Return numba's, which keeps machine code next to the source, or in the user's cache."""
        with _LOCK:
            if self._dispatcher is None:
                _prepare_numba()
                while _CALLABLE:
                    numba.extending.register_jitable(_CALLABLE.pop())
                try:
                    self._dispatcher = numba.njit(self._function, cache=True, **self._options)
                except RuntimeError:
                    log.warning(
                        'compiled kernels (30 s) cannot be kept for other processes; NUMBA_CACHE_DIR names a folder'
                    )
                    self._dispatcher = numba.njit(self._function, **self._options)
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
    os.environ.setdefault('NUMBA_CACHE_DIR', '')
    numba.config.CACHE_DIR = os.environ['NUMBA_CACHE_DIR']

    def type_of_kernel(kernel: Kernel, context: Any) -> Any:
        del context
        return numba.typeof(kernel.dispatcher)

    numba.extending.typeof_impl.register(Kernel)(type_of_kernel)
