"""Counting reports that have not come, by the gaps between the stamps of the others."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# How much of its lateness a report hands on to the next: jitter cancels, and a slow clock is not taken for loss.
LATENESS_KEPT = 0.98


class LostReports:
    """Compares stamps with the rate at which reports should come."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._newest_ns: Optional[int] = None
        self._late = 0.0  # the newest report, in periods
        self._missing = 0

    @property
    def count(self) -> int:
        """Return how many have not come so far."""
        return max(self._missing, 0)

    def take(self, stamp_ns: int) -> None:
        """Take the stamp of a report; one that goes back begins anew, and keeps the count."""
        newest_ns, self._newest_ns = self._newest_ns, stamp_ns
        if newest_ns is None or stamp_ns < newest_ns:
            self._late = 0.0
            return
        periods = (stamp_ns - newest_ns) * self._rate_hz / NANOSECONDS_PER_SECOND + LATENESS_KEPT * self._late
        passed = round(periods)  # none for one that comes right after a late one
        self._late = periods - passed
        self._missing += passed - 1
