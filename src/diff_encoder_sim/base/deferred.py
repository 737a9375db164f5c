"""Deferred import of libraries that take long to import."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Callable

__all__ = ['deferred', 'pandas']


class _Deferred:
    """Placeholder of a module, imported at the first access to an attribute."""

    def __init__(self, name: str, load: Callable[[str], Any]) -> None:
        self._name, self._load = name, load

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(self._load(self._name), attribute)
        setattr(self, attribute, value)  # found without this method from now on
        return value


def deferred(name: str, load: Callable[[str], Any] = importlib.import_module) -> Any:
    """Return a placeholder of the module with this full name; `load` imports it."""
    return _Deferred(name, load)


if TYPE_CHECKING:
    import pandas
else:
    pandas = deferred('pandas')
