"""Link from the motor controller to the host, with delay, loss, duplication and reordering."""

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
    wheel_rates_radps: Optional[Tuple[float, float]] = None  # left, right, measured by the controller


ShortDuration_s = Annotated[float, Between(0.0, 10.0, 's')]

# Samples keep their order: jitter is less than a period.
MOST_JITTER_PERIODS = 0.9

# A reordered report arrives half a period after the next one.
REORDERED_PERIODS = 1.5

# Odometry ignores late reports; a stamp further back than this starts a new run.
LATE_REPORT_TOLERANCE_NS = 500_000_000

# This number of reports is lost in a row only once in a million, and hardly ever more than that many.
_RARE, _MOST_IN_A_ROW = 1e-6, 100


class ReportParams(Params):
    """Report transmission; by default immediate and complete, stamped with the time of the sample."""

    jitter: ShortDuration_s = Field(0.0, description='maximum delay of a sample after its boundary [s]')
    latency: ShortDuration_s = Field(0.0, description='from sample to arrival, at least [s]')
    latency_spread: ShortDuration_s = Field(0.0, description='maximum additional latency, uniform [s]')
    stamps: Literal['sample', 'arrival'] = Field('sample', description='the time in the stamp')
    lost: Fraction = Field(0.0, description='fraction of the reports that never come')
    repeated: Fraction = Field(0.0, description='fraction that come twice, the second time with the next report')
    reordered: Fraction = Field(0.0, description='fraction that come only after the next report')

    @property
    def are_even(self) -> bool:
        """Return whether every period has a report with constant latency."""
        return not (self.jitter or self.latency_spread or self.lost or self.reordered)

    def jitter_within_s(self, period_s: float) -> float:
        """Return the maximum jitter of samples with this period [s]."""
        return min(self.jitter, MOST_JITTER_PERIODS * period_s)

    def longest_delay_s(self, period_s: float) -> float:
        """Return the time from a boundary until its report or a later one has arrived, except in rare cases [s]."""
        periods = REORDERED_PERIODS if self.reordered else 0.0
        if self.lost:
            in_a_row = math.log(_RARE) / math.log(self.lost) if self.lost < 1.0 else math.inf
            periods += math.ceil(min(in_a_row, _MOST_IN_A_ROW))
        return self.jitter_within_s(period_s) + self.latency + self.latency_spread + periods * period_s

    def most_behind_s(self, period_s: float) -> Dict[str, float]:
        """Return the maximum lag of a report's stamp behind the newest received stamp, as a sum by keys [s]."""
        parts_s = {
            'latency_spread': self.latency_spread,
            'reordered': REORDERED_PERIODS * period_s if self.reordered else 0.0,
            'repeated': period_s if self.repeated else 0.0,
        }
        return parts_s if self.stamps == 'sample' else {}  # arrival stamps are always in order


PROMPT = ReportParams()


class ReportLink:
    """Delivers samples when the joint stamps reach their arrival time."""

    def __init__(self, params: ReportParams, period_s: float, rng: np.random.Generator) -> None:
        """Create a link for samples with period `period_s`."""
        self._params, self._rng = params, rng
        self._period_ns = period_s * NANOSECONDS_PER_SECOND
        self._coming: List[Tuple[int, int, EncoderSample]] = []  # by arrival, then in order
        self._sent = 0

    def arrivals_ns(self, stamp_ns: int) -> List[int]:
        """Return the arrival times of the next sample: none, one or two."""
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
        """Send a sample, and return the samples that arrive up to now.

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
