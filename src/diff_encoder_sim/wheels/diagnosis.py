"""What nodes say about themselves on /diagnostics."""

from __future__ import annotations

from typing import Dict, NamedTuple


class Diagnosis(NamedTuple):
    """A state, and what is wrong with it."""

    warning: str  # empty where nothing is
    values: Dict[str, float]
