"""Control rate: which odometry stamps begin a control period."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class ControlRate:
    """Selects the odometry stamps to control at, as many per second as the rate.

    A stamp may be half a period early or late, so that odometry at the rate itself is never skipped for its
    jitter. Of slower odometry every stamp is selected.
    """

    def __init__(self, frequency_hz: float) -> None:
        self._period_ns = round(NANOSECONDS_PER_SECOND / frequency_hz)
        self._due_ns: Optional[int] = None

    def is_due(self, stamp_ns: int) -> bool:
        """Return whether to control at this stamp; always True after time has jumped back."""
        period_ns = self._period_ns
        due_ns = stamp_ns if self._due_ns is None else self._due_ns
        if period_ns // 2 < due_ns - stamp_ns <= 2 * period_ns:
            return False
        is_on_schedule = abs(stamp_ns - due_ns) < period_ns
        self._due_ns = (due_ns if is_on_schedule else stamp_ns) + period_ns
        return True
