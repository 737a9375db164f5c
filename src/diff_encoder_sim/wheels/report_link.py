"""The way of a report from the motor controller to the host: late, lost, twice, or out of order."""

from __future__ import annotations

import heapq
import math
from typing import Dict, List, Literal, NamedTuple, Optional, Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, Fraction
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class EncoderSample(NamedTuple):
    """The counters as read at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int
    wheel_rates_radps: Optional[Tuple[float, float]] = None  # left, right, as the controller measures them


ShortDuration_s = Annotated[float, Between(0.0, 10.0, 's')]

# Samples keep their order: none is as late as the next one's boundary.
MOST_JITTER_PERIODS = 0.9

# A report that comes after the next one comes half a period after it.
REORDERED_PERIODS = 1.5

# Odometry ignores a report that others have overtaken; one that is further back than this belongs to a new run.
LATE_REPORT_TOLERANCE_NS = 500_000_000

# So many reports are lost in a row only once in a million, and hardly ever more than that many.
_RARE, _MOST_IN_A_ROW = 1e-6, 100


class ReportParams(Params):
    """How reports come; left out, at once, each one, with the time of the sample."""

    jitter: ShortDuration_s = Field(0.0, description='a sample is up to so much later than its boundary [s]')
    latency: ShortDuration_s = Field(0.0, description='from sample to arrival, at least [s]')
    latency_spread: ShortDuration_s = Field(0.0, description='and up to so much more, evenly [s]')
    stamps: Literal['sample', 'arrival'] = Field('sample', description='the time in the stamp')
    lost: Fraction = Field(0.0, description='fraction of the reports that never come')
    repeated: Fraction = Field(0.0, description='fraction that come twice, the second time with the next report')
    reordered: Fraction = Field(0.0, description='fraction that come only after the next report')

    @property
    def are_even(self) -> bool:
        """Return whether a report comes in each period, and each one after the same time."""
        return not (self.jitter or self.latency_spread or self.lost or self.reordered)

    def jitter_within_s(self, period_s: float) -> float:
        """Return by how much a sample may be late [s], for samples each `period_s`."""
        return min(self.jitter, MOST_JITTER_PERIODS * period_s)

    def longest_delay_s(self, period_s: float) -> float:
        """Return by when a report or a later one has come, but for rare cases, from its boundary [s]."""
        periods = REORDERED_PERIODS if self.reordered else 0.0
        if self.lost:
            in_a_row = math.log(_RARE) / math.log(self.lost) if self.lost < 1.0 else math.inf
            periods += math.ceil(min(in_a_row, _MOST_IN_A_ROW))
        return self.jitter_within_s(period_s) + self.latency + self.latency_spread + periods * period_s

    def most_behind_s(self, period_s: float) -> Dict[str, float]:
        """Return by how much at most a report's stamp is behind the newest that has come, as a sum by keys [s].

        What has come before a report was sampled before the report was, or within what its delay is above the least.
        Stamps of arrivals are in order.
        """
        if self.stamps == 'arrival':
            return {}
        return {
            'latency_spread': self.latency_spread,
            'reordered': REORDERED_PERIODS * period_s if self.reordered else 0.0,
            'repeated': period_s if self.repeated else 0.0,
        }


PROMPT = ReportParams()


class ReportLink:
    """Delivers samples when the stamps of the joints have reached the time of their arrival."""

    def __init__(self, params: ReportParams, period_s: float, rng: np.random.Generator) -> None:
        """Prepare for samples each `period_s`."""
        self._params, self._rng = params, rng
        self._period_ns = period_s * NANOSECONDS_PER_SECOND
        self._coming: List[Tuple[int, int, EncoderSample]] = []  # by arrival, then in order
        self._sent = 0

    def arrivals_ns(self, stamp_ns: int) -> List[int]:
        """Return when a sample arrives, which may be never, or twice. Each call is for the next sample."""
        params = self._params
        lost, repeated, reordered, late = self._rng.random(4).tolist()
        if lost < params.lost:
            return []
        delay_ns = (params.latency + late * params.latency_spread) * NANOSECONDS_PER_SECOND
        if reordered < params.reordered:
            delay_ns += REORDERED_PERIODS * self._period_ns
        delays_ns = [delay_ns, delay_ns + self._period_ns] if repeated < params.repeated else [delay_ns]
        return [stamp_ns + round(each_ns) for each_ns in delays_ns]

    def pass_on(self, now_ns: int, sample: Optional[EncoderSample]) -> List[EncoderSample]:
        """Send a sample, and return those that arrive up to now.

        Args:
            now_ns: the newest stamp of the joints.
            sample: taken since the last call; None if none was.
        """
        if sample is not None:
            for arrival_ns in self.arrivals_ns(sample.stamp_ns):
                self._sent += 1
                stamp_ns = arrival_ns if self._params.stamps == 'arrival' else sample.stamp_ns
                heapq.heappush(self._coming, (arrival_ns, self._sent, sample._replace(stamp_ns=stamp_ns)))
        arrived = []
        while self._coming and self._coming[0][0] <= now_ns:
            arrived.append(heapq.heappop(self._coming)[2])
        return arrived
