"""Libraries that take long to import, and are imported when they are first used."""

from __future__ import annotations

import importlib
from typing import Any


class _Deferred:
    """Stands for a module, and imports it for the first of its names that is asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(importlib.import_module(self._name), attribute)
        setattr(self, attribute, value)  # from now on found without this method
        return value


def deferred(name: str) -> Any:
    """Return what can be used in place of a module, by its full name."""
    return _Deferred(name)
