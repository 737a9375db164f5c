"""Message stamps in integer nanoseconds: valid stamps, new stamps, and jumps back in time."""

from __future__ import annotations

import enum
from typing import Optional

from diff_encoder_sim.base.errors import InputFault

NANOSECONDS_PER_SECOND = 1_000_000_000

# A stamp of ROS has 32 bits of seconds, and bags of ROS 1 have such stamps.
LATEST_NS = 2**32 * NANOSECONDS_PER_SECOND

# tf2 adds and subtracts stamps in 32 bits, and aborts the process at an overflow. Stamps below 2^31 s (January 2038)
# do not overflow.
STAMP_LIMIT_S = 2**31

# A transform farther ahead removes the valid ones from tf2's buffer of 10 s.
MOST_AHEAD_S = 10.0


def check_stamp(stamp_ns: int, now_ns: int = 0, most_ahead_s: float = MOST_AHEAD_S) -> None:
    """Raise InputFault if a stamp is not valid for TF, or too far ahead of the clock (0 if unknown)."""
    stamp_s, ahead_s = stamp_ns / NANOSECONDS_PER_SECOND, (stamp_ns - now_ns) / NANOSECONDS_PER_SECOND
    if stamp_ns >= STAMP_LIMIT_S * NANOSECONDS_PER_SECOND:
        raise InputFault(f'stamp {stamp_s:.3f} s; allowed: below {STAMP_LIMIT_S} s, as TF can hold no more')
    if now_ns and ahead_s > most_ahead_s:
        raise InputFault(
            f'stamp {stamp_s:.3f} s is {ahead_s:.1f} s ahead of the clock; allowed: up to {most_ahead_s:g} s'
        )


class Step(enum.Enum):
    """How a stamp relates to the newest one before it."""

    NEW = 'later: use it'
    STALE = 'repeated, or overtaken by a newer one: ignore it'
    RESTART = 'time has jumped back: reset'


class Timeline:
    """Classifies stamps as new, stale or restart.

    A stamp that goes back by up to `tolerance_ns` is a message overtaken by another (several publishers on one topic).
    Further back, time was reset: a bag loops, or the simulator was reset.
    """

    def __init__(self, tolerance_ns: int) -> None:
        self._tolerance_ns = tolerance_ns
        self.newest_ns: Optional[int] = None

    def advance(self, stamp_ns: int) -> Step:
        """Classify `stamp_ns` and, unless it is stale, store it as the newest."""
        newest_ns = self.newest_ns
        if newest_ns is not None and newest_ns - self._tolerance_ns <= stamp_ns <= newest_ns:
            return Step.STALE
        self.newest_ns = stamp_ns
        return Step.NEW if newest_ns is None or stamp_ns > newest_ns else Step.RESTART
