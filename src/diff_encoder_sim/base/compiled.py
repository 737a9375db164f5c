"""`compiled`, the decorator of all numba kernels."""

from __future__ import annotations

import functools
import os
from typing import Any, Callable, TypeVar, overload

import numba

from diff_encoder_sim.base.machine_code import FOLDER_VARIABLE, machine_code_folder

Kernel = TypeVar('Kernel', bound=Callable[..., Any])


@overload
def compiled(kernel: Kernel) -> Kernel: ...


@overload
def compiled(**options: Any) -> Callable[[Kernel], Kernel]: ...


def compiled(*kernel: Any, **options: Any) -> Any:
    """Compile a kernel when it is first called, with `options` of numba.jit, and keep the machine code."""
    decorate: Any = numba.njit
    return decorate(*kernel, cache=_is_kept(), **options)


@functools.lru_cache(maxsize=None)
def _is_kept() -> bool:
    """Select where machine code is kept, for this process and those that it starts; return whether it is."""
    folder = machine_code_folder()
    if folder:
        # For processes that this one starts; and for numba, which has read its environment.
        os.environ[FOLDER_VARIABLE] = folder
        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]  # numba makes its settings when it starts
    return folder is not None
