"""`compiled`, the decorator of all numba kernels. numba is imported when the first of them is called."""

from __future__ import annotations

import functools
import hashlib
import os
import sys
import threading
import uuid
from types import CodeType, ModuleType
from typing import AbstractSet, Any, Callable, FrozenSet, Optional, Set, TypeVar, overload

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.kernel_cache import keep_code
from diff_encoder_sim.base.machine_code import FOLDER_VARIABLE, machine_code_folder

numba = deferred('numba')

Function = TypeVar('Function', bound=Callable[..., Any])


class Kernel:
    """A function that numba compiles when it is first called, from Python or by another kernel that is compiled."""

    def __init__(self, function: Callable[..., Any], options: Any) -> None:
        functools.update_wrapper(self, function)
        self._function, self._options = function, options
        # Now: the file may be edited before the function, as it was imported, is compiled.
        self._source = _content(function.__code__.co_filename)
        self._dispatcher: Optional[Any] = None

    def __call__(self, *arguments: Any) -> Any:  # noqa: D102 (that of the function)
        return (self._dispatcher or self.dispatcher)(*arguments)

    @property
    def dispatcher(self) -> Any:
        """Return numba's."""
        with _LOCK:
            if self._dispatcher is None:
                _make_known()
                dispatcher = numba.njit(self._function, **self._options)
                if _is_kept():
                    keep_code(dispatcher, _sources(self))
                self._dispatcher = dispatcher
        return self._dispatcher

    def __getattr__(self, name: str) -> Any:
        # What numba asks a kernel that another one calls: its options, and the function.
        if name.startswith('__'):
            raise AttributeError(name)
        return getattr(self.dispatcher, name)


_LOCK = threading.RLock()


@overload
def compiled(kernel: Function) -> Function: ...


@overload
def compiled(**options: Any) -> Callable[[Function], Function]: ...


def compiled(*kernel: Any, **options: Any) -> Any:
    """Compile a kernel when it is first called, with `options` of numba.njit, and keep the machine code if possible."""
    if kernel:
        return Kernel(kernel[0], options)
    return lambda function: Kernel(function, options)


def _names(code: CodeType) -> Set[str]:
    """Return the global names that code uses, comprehensions included."""
    inner = (_names(one) for one in code.co_consts if isinstance(one, CodeType))
    return set(code.co_names).union(*inner)


@functools.lru_cache(maxsize=None)
def _sources(kernel: Kernel) -> FrozenSet[str]:
    """Return what the machine code of a kernel is made from, with that of the kernels that it calls."""
    names, used = kernel._function.__globals__, _names(kernel._function.__code__)
    parts = (_made_from(f'{kernel.__module__}.{name}', names[name]) for name in used.intersection(names))
    return frozenset({kernel._source}.union(*parts))


def _made_from(name: str, value: Any) -> AbstractSet[str]:
    """Return what numba makes code from for a global name: a number itself, of a class or module what its file says."""
    if isinstance(value, Kernel):
        return _sources(value)
    if hasattr(value, 'tolist'):  # an array, which repr() would shorten
        return {f'{name} {value.dtype} {value.tolist()}'}
    if isinstance(value, ModuleType) or callable(value):
        file = getattr(sys.modules.get(getattr(value, '__module__', ''), value), '__file__', None)
        return {_content(file)} if file else set()
    return {f'{name} {value!r}'}


@functools.lru_cache(maxsize=None)
def _content(file: str) -> str:
    """Return a hash of a file. Its time would say less: whole seconds in archives, and another one for each copy."""
    try:
        with open(file, 'rb') as source:
            return hashlib.sha256(source.read()).hexdigest()
    except OSError:  # no file, or it cannot be read: as nothing tells its changes, no code is found again
        return uuid.uuid4().hex


@functools.lru_cache(maxsize=None)
def _make_known() -> None:
    """Tell numba what a kernel is that another one calls."""

    def type_of_kernel(kernel: Kernel, context: Any) -> Any:
        del context
        return numba.typeof(kernel.dispatcher)

    numba.extending.typeof_impl.register(Kernel)(type_of_kernel)


@functools.lru_cache(maxsize=None)
def _is_kept() -> bool:
    """Select where machine code is kept, for this process and those that it starts; return whether it is."""
    folder = machine_code_folder()
    if folder is not None:
        # For processes that this one starts; and for numba, which has read its environment, and whatever
        # .numba_config.yaml is in the current folder: code from a folder that another user chose is not run.
        os.environ[FOLDER_VARIABLE] = folder
        numba.config.CACHE_DIR = folder
    return folder is not None
