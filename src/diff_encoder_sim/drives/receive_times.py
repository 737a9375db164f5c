"""How even the times are at which messages without a stamp of their own were received."""

from __future__ import annotations

import math
from typing import Optional, Sequence


class ReceiveTimes:
    """Mean and standard deviation of the intervals between the messages of a topic, as they come."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._last_ns: Optional[int] = None
        self._count, self._mean_ns, self._squares = 0, 0.0, 0.0

    def add(self, time_ns: int) -> None:
        """Take the next message."""
        if self._last_ns is not None:
            self._count += 1
            interval_ns = time_ns - self._last_ns
            deviation_ns = interval_ns - self._mean_ns
            self._mean_ns += deviation_ns / self._count
            self._squares += deviation_ns * (interval_ns - self._mean_ns)
        self._last_ns = time_ns

    def text(self) -> str:
        """Return mean and standard deviation."""
        std_ns = math.sqrt(self._squares / self._count) if self._count else 0.0
        return f'{self.topic} every {1e-6 * self._mean_ns:.1f} ms +- {1e-6 * std_ns:.1f} ms'


def receive_times_note(times: Sequence[ReceiveTimes]) -> str:
    """Say in one line what the stamps of the topics are."""
    return (
        f'no stamps: the times of receipt are used, of {" and ".join(each.text() for each in times)} (mean, standard '
        f'deviation); this jitter is in speeds and comparisons, not in the counts'
    )
