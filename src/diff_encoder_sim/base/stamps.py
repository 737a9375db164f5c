"""Stamps of messages in integer nanoseconds: which are new, and when time jumps back."""

from __future__ import annotations

import enum
from typing import Optional

NANOSECONDS_PER_SECOND = 1_000_000_000


class Step(enum.Enum):
    """How a stamp relates to the newest one before it."""

    NEW = 'later: use it'
    STALE = 'repeated, or overtaken by a newer one: ignore it'
    RESTART = 'time has jumped back: reset'


class Timeline:
    """Classifies stamps as new, stale or restart.

    A stamp that goes back by up to `tolerance_ns` is a message overtaken by another (several
    publishers on one topic). Further back, time itself was reset: a bag loops, or the simulator
    was reset.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self._tolerance_ns = tolerance_ns
        self.newest_ns: Optional[int] = None

    def advance(self, stamp_ns: int) -> Step:
        """Classify `stamp_ns` and, unless it is stale, take it as the newest."""
        if self.newest_ns is None or stamp_ns > self.newest_ns:
            step = Step.NEW
        elif stamp_ns >= self.newest_ns - self._tolerance_ns:
            return Step.STALE
        else:
            step = Step.RESTART
        self.newest_ns = stamp_ns
        return step
