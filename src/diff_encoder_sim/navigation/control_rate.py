"""When a control period begins, where odometry comes at a rate of its own."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class ControlRate:
    """Picks the stamps to control at: as many a second as the rate, of those that come.

    Each period's stamp may be half a period early or late: odometry at the very rate is never
    skipped for its jitter. Where it is slower, every stamp counts.
    """

    def __init__(self, frequency_hz: float) -> None:
        self._period_ns = round(NANOSECONDS_PER_SECOND / frequency_hz)
        self._due_ns: Optional[int] = None

    def is_due(self, stamp_ns: int) -> bool:
        """Whether to control at this stamp; after time has gone back always."""
        due_ns, period_ns = self._due_ns, self._period_ns
        if due_ns is not None and period_ns // 2 < due_ns - stamp_ns <= 2 * period_ns:
            return False
        is_on_schedule = due_ns is not None and abs(stamp_ns - due_ns) < period_ns
        self._due_ns = (due_ns if is_on_schedule else stamp_ns) + period_ns
        return True
