"""The wheel's speed as a motor controller measures it, from the times of edges.

M, the counts of a period, needs no more than the counts: odometry computes it. T and M/T are from here
(Ohmae et al., A microprocessor-controlled high-accuracy wide-range speed regulator for motor drives, IEEE
Transactions on Industrial Electronics, 1982).
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, Optional

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

VelocityMethod = Annotated[
    Literal['M', 'T', 'MT'],
    Field(description='of the twist: counts per period (M), time between edges (T), or both (MT)'),
]
VelocityClock_Hz = Annotated[
    float, Between(1.0, 1e9, 'Hz'), Field(description='of the clock that times edges for T and MT [Hz]')
]
DEFAULT_CLOCK_HZ = 1e6

# As where the timer of a motor controller overflows: no edge for so long is standstill. The speed was at most one count
# in this time, 0.3 rad/s at 40 PPR.
STANDSTILL_AFTER_S = 0.5


class TimedEdge(NamedTuple):
    """An edge that was counted."""

    time_ns: float
    edge: int  # its number, or turning backward the one before: the count that it led to
    direction: int  # +1 forward, -1 backward


class WheelRate:
    """The mean speed between two edges: the last two (T), or the last ones of two reports (M/T)."""

    def __init__(self, method: VelocityMethod, rad_per_count: float, clock_hz: float) -> None:
        """Prepare for a clock that counts up each 1/`clock_hz`."""
        self._is_t, self._rad_per_count = method == 'T', rad_per_count
        self._tick_ns = NANOSECONDS_PER_SECOND / clock_hz
        self._first: Optional[TimedEdge] = None  # of those that the speed is between
        self._last: Optional[TimedEdge] = None
        self._rate_radps = 0.0

    def take_edges(self, one_before: Optional[TimedEdge], last: TimedEdge) -> None:
        """Take the edges since the call before: the last one, and with it the one before where that is as new."""
        if self._is_t:
            self._first = one_before or self._last
        self._last = last

    def report(self, now_ns: int) -> float:
        """Return the speed [rad/s] at a report; while no edge comes, at most a count since the last one, then zero."""
        if self._last is None:
            return 0.0
        if self._first is not None and self._first is not self._last:
            self._rate_radps = self._between(self._first, self._last)
        if not self._is_t:
            self._first = self._last
        since_s = (now_ns - self._last.time_ns) / NANOSECONDS_PER_SECOND
        if since_s > STANDSTILL_AFTER_S:
            return 0.0
        fastest_radps = self._rad_per_count / since_s if since_s > 0.0 else math.inf
        return math.copysign(min(abs(self._rate_radps), fastest_radps), self._rate_radps)

    def _between(self, first: TimedEdge, last: TimedEdge) -> float:
        if self._is_t and first.direction != last.direction:
            return 0.0  # the same edge, there and back
        ticks = math.floor(last.time_ns / self._tick_ns) - math.floor(first.time_ns / self._tick_ns)
        # Two edges in one tick: the fastest that the clock can show.
        interval_s = max(ticks, 1) * self._tick_ns / NANOSECONDS_PER_SECOND
        return (last.edge - first.edge) * self._rad_per_count / interval_s
