"""Sampling at a fixed rate of stamps, independent of arrival times."""

from __future__ import annotations

from fractions import Fraction
from typing import Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# Default report rate of encoders and rate of nodes that process reports.
DEFAULT_RATE_HZ = 20.0


class BoundarySampler:
    """Finds the first stamp at or after each boundary of a fixed rate."""

    def __init__(self, rate_hz: float) -> None:
        self._periods, self._in_ns = _periods_in_ns(rate_hz)
        self._newest_index: Optional[int] = None
        self.next_ns = 0  # earlier stamps do not reach a boundary

    def period_index(self, stamp_ns: int) -> Optional[int]:
        """Return the index of the boundary if `stamp_ns` is the first to reach it, else None."""
        index, remainder = divmod(stamp_ns * self._periods, self._in_ns)
        if self._newest_index is not None and index <= self._newest_index:
            return None
        # The first stamp only opens a period, unless it is on the boundary.
        opens_quietly = self._newest_index is None and remainder != 0
        self._newest_index, self.next_ns = index, -(-(index + 1) * self._in_ns // self._periods)
        return None if opens_quietly else index


class BoundaryTimes:
    """The stamps that a `BoundarySampler` picks from samples at 0 and at every multiple of `tick_ns`."""

    def __init__(self, rate_hz: float, tick_ns: int) -> None:
        self._periods, self._in_ns = _periods_in_ns(rate_hz)
        self._tick_ns = tick_ns

    def newest_ns(self, time_ns: int) -> int:
        """Return the newest stamp at or before `time_ns`, a multiple of the tick; negative before 0."""
        index = time_ns * self._periods // self._in_ns
        boundary_ns = -(-index * self._in_ns // self._periods)
        return -(-boundary_ns // self._tick_ns) * self._tick_ns


def _periods_in_ns(rate_hz: float) -> Tuple[int, int]:
    """Return a rate as whole periods in whole nanoseconds: exact, so that boundaries do not drift."""
    rate_per_ns = Fraction(rate_hz).limit_denominator(10**6) / NANOSECONDS_PER_SECOND
    return rate_per_ns.numerator, rate_per_ns.denominator
