"""One wheel behind the motor controller: its angles become pulse counts at the boundaries of the report rate."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, Dict, NamedTuple, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.counting_wheel import CountingWheel, IdealWheel
from diff_encoder_sim.wheels.sampling import BoundarySampler

# A wheel that no message has named for this long is missing, not merely interleaved.
MISSING_AFTER_NS = NANOSECONDS_PER_SECOND


class WheelSample(NamedTuple):
    """The wheel's count at one instant, before the counter wraps it."""

    stamp_ns: int
    pulses: int
    rate_radps: Optional[float] = None  # None where the controller measures no speed


class WheelChannel:
    """A wheel's stamps, its sampling, and its samples that are not yet reported."""

    def __init__(
        self, joint: str, wheel: Union[IdealWheel, CountingWheel], rate_hz: float, jitters_ns: Sequence[int] = ()
    ) -> None:
        """Prepare to sample a wheel.

        Args:
            joint: its name.
            wheel: turned by the angles.
            rate_hz: of the samples.
            jitters_ns: how much later than the first stamp at its boundary a sample is taken, by its index, again
                and again; less than the period. None: at that stamp.
        """
        self.joint = joint
        self.wheel = wheel
        self._sampler = BoundarySampler(rate_hz)
        self._timeline = Timeline(tolerance_ns=int(2 * NANOSECONDS_PER_SECOND / rate_hz))
        self._jitters_ns = jitters_ns
        self._due: Deque[Tuple[int, int]] = deque()  # stamps and indices of samples that jitter has put off
        self._last: Optional[Tuple[int, float]] = None  # stamp and angle
        self.samples: Dict[int, WheelSample] = {}  # by period, for as long as the other wheel may be late
        self._kept_periods = math.ceil(MISSING_AFTER_NS * rate_hz / NANOSECONDS_PER_SECOND) + 1

    def take(self, stamp_ns: int, angle_rad: float) -> Step:
        """Feed one angle; after RESTART the channel must be replaced by a new one."""
        step = self._timeline.advance(stamp_ns)
        if step is Step.NEW:
            index = self._sampler.period_index(stamp_ns)
            if self._jitters_ns:
                self._sample_late(stamp_ns, angle_rad, index)
            self.wheel.turn_to(stamp_ns, angle_rad)
            if index is not None and not self._jitters_ns:
                self._sample(stamp_ns, index)
        return step

    def _sample_late(self, stamp_ns: int, angle_rad: float, index: Optional[int]) -> None:
        """Take the samples that are due by now, at angles between the last one and this."""
        while self._due and self._last and self._due[0][0] < stamp_ns:
            due_ns, due_index = self._due.popleft()
            last_ns, last_rad = self._last
            passed = (due_ns - last_ns) / (stamp_ns - last_ns)
            self.wheel.turn_to(due_ns, last_rad + passed * (angle_rad - last_rad))
            self._sample(due_ns, due_index)
        if index is not None:
            self._due.append((stamp_ns + self._jitters_ns[index % len(self._jitters_ns)], index))
        self._last = stamp_ns, angle_rad

    def _sample(self, stamp_ns: int, index: int) -> None:
        self.samples[index] = WheelSample(stamp_ns, self.wheel.count(), self.wheel.rate_radps(stamp_ns))
        self.drop_before(index - self._kept_periods)

    def drop_before(self, period_index: int) -> None:
        """Drop the samples of periods before this one."""
        while self.samples and next(iter(self.samples)) < period_index:
            del self.samples[next(iter(self.samples))]

    @property
    def last_seen_ns(self) -> Optional[int]:
        """Stamp of the newest angle taken."""
        return self._timeline.newest_ns
