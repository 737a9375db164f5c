"""How many counts and reports come in a second."""

from __future__ import annotations

from typing import Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.counter import count_difference

OVER_NS = NANOSECONDS_PER_SECOND


class CountRate:
    """Counts each second of stamps anew; zero before the first is over."""

    def __init__(self, counter_modulus: int) -> None:
        self._modulus = counter_modulus
        self._newest: Optional[Tuple[int, int, int]] = None  # stamp, left, right
        self._begin(0)
        self.counts_per_s = (0.0, 0.0)  # left, right
        self.reports_per_s = 0.0

    def take(self, stamp_ns: int, left_count: int, right_count: int) -> None:
        """Take a report; after a stamp that goes back the second begins anew."""
        newest, self._newest = self._newest, (stamp_ns, left_count, right_count)
        if newest is None or stamp_ns < newest[0]:
            self._begin(stamp_ns)
            return
        self._reports += 1
        self._left += count_difference(left_count, newest[1], self._modulus)
        self._right += count_difference(right_count, newest[2], self._modulus)
        if stamp_ns - self._since_ns >= OVER_NS:
            over_s = (stamp_ns - self._since_ns) / NANOSECONDS_PER_SECOND
            self.counts_per_s = self._left / over_s, self._right / over_s
            self.reports_per_s = self._reports / over_s
            self._begin(stamp_ns)

    def _begin(self, stamp_ns: int) -> None:
        self._since_ns, self._reports, self._left, self._right = stamp_ns, 0, 0, 0
