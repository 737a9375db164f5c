"""Libraries that take long to import, and are imported when they are first used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Callable

__all__ = ['deferred', 'pandas']


class _Deferred:
    """Stands for a module, and imports it for the first of its names that is asked for."""

    def __init__(self, name: str, load: Callable[[str], Any]) -> None:
        self._name, self._load = name, load

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(self._load(self._name), attribute)
        setattr(self, attribute, value)  # from now on found without this method
        return value


def deferred(name: str, load: Callable[[str], Any] = importlib.import_module) -> Any:
    """Return what can be used in place of a module, by its full name; `load` imports it."""
    return _Deferred(name, load)


if TYPE_CHECKING:
    import pandas
else:
    pandas = deferred('pandas')
