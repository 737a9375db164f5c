"""One wheel behind the motor controller: its angles become pulse counts at the boundaries of the report rate."""

from __future__ import annotations

import math
from typing import Dict, NamedTuple, Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.encoders.pulses import pulses_from_angle
from diff_encoder_sim.encoders.sampling import BoundarySampler

# A wheel that no message has named for this long is missing, not merely interleaved.
MISSING_AFTER_NS = NANOSECONDS_PER_SECOND


class WheelSample(NamedTuple):
    """The wheel's count at one instant, before the counter wraps it."""

    stamp_ns: int
    pulses: int


class WheelChannel:
    """A wheel's stamps, its sampling, and its samples that are not yet reported."""

    def __init__(self, joint: str, ppr: float, rate_hz: float) -> None:
        self.joint = joint
        self._ppr = ppr
        self._sampler = BoundarySampler(rate_hz)
        self._timeline = Timeline(tolerance_ns=int(2 * NANOSECONDS_PER_SECOND / rate_hz))
        self.samples: Dict[int, WheelSample] = {}  # by period, for as long as the other wheel may be late
        self._kept_periods = math.ceil(MISSING_AFTER_NS * rate_hz / NANOSECONDS_PER_SECOND) + 1

    def take(self, stamp_ns: int, angle_rad: float) -> Step:
        """Feed one angle; after RESTART the channel must be replaced by a new one."""
        step = self._timeline.advance(stamp_ns)
        if step is Step.NEW:
            index = self._sampler.period_index(stamp_ns)
            if index is not None:
                self.samples[index] = WheelSample(stamp_ns, pulses_from_angle(angle_rad, self._ppr))
                self.drop_before(index - self._kept_periods)
        return step

    def drop_before(self, period_index: int) -> None:
        """Drop the samples of periods before this one."""
        while self.samples and next(iter(self.samples)) < period_index:
            del self.samples[next(iter(self.samples))]

    @property
    def last_seen_ns(self) -> Optional[int]:
        """Stamp of the newest angle taken."""
        return self._timeline.newest_ns
