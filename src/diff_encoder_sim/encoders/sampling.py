"""Sampling at a fixed rate of stamps, whenever the messages arrive."""

from __future__ import annotations

from fractions import Fraction
from typing import Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class BoundarySampler:
    """Finds the first stamp at or after each boundary of a fixed rate."""

    def __init__(self, rate_hz: float) -> None:
        # Exact rational arithmetic: 20 Hz boundaries must not drift off 50 ms after an hour.
        rate_per_ns = Fraction(rate_hz).limit_denominator(10**6) / NANOSECONDS_PER_SECOND
        # As two whole numbers, because a Fraction takes ten times as long for a product.
        self._periods, self._in_ns = rate_per_ns.numerator, rate_per_ns.denominator
        self._newest_index: Optional[int] = None

    def period_index(self, stamp_ns: int) -> Optional[int]:
        """Return the index of the boundary that `stamp_ns` is the first to reach, else None."""
        index, remainder = divmod(stamp_ns * self._periods, self._in_ns)
        if self._newest_index is not None and index <= self._newest_index:
            return None
        # The very first stamp only opens a period, unless it lies on the boundary itself.
        opens_quietly = self._newest_index is None and remainder != 0
        self._newest_index = index
        return None if opens_quietly else index
