"""What an encoder reports."""

from __future__ import annotations

from typing import NamedTuple, Optional, Tuple


class EncoderSample(NamedTuple):
    """The counters as read at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int
    wheel_rates_radps: Optional[Tuple[float, float]] = None  # left, right, as the controller measures them
