"""Reports of a controller: sampled at a fixed rate, sent over a link to the host, paired with measured speeds."""

from __future__ import annotations

import fractions
import logging
import math
import operator
from collections import deque
from typing import Deque, Dict, List, Literal, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, Fraction
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# Default report rate of encoders and rate of nodes that process reports.
DEFAULT_RATE_HZ = 20.0


class BoundarySampler:
    """Finds the first stamp at or after each boundary of a fixed rate, in samples at multiples of `tick_ns`."""

    def __init__(self, rate_hz: float, tick_ns: int = 1) -> None:
        # Whole periods in whole nanoseconds: exact, so that boundaries do not drift.
        per_ns = fractions.Fraction(rate_hz).limit_denominator(10**6) / NANOSECONDS_PER_SECOND
        self._periods, self._in_ns = per_ns.numerator, per_ns.denominator
        self._tick_ns = tick_ns
        self._newest_index: Optional[int] = None
        self.next_ns = 0  # earlier stamps do not reach a boundary

    def period_index(self, stamp_ns: int) -> Optional[int]:
        """Return the index of the boundary if `stamp_ns` is the first to reach it, else None."""
        index, remainder = divmod(stamp_ns * self._periods, self._in_ns)
        if self._newest_index is not None and index <= self._newest_index:
            return None
        # The first stamp only opens a period, unless it is on the boundary.
        opens_quietly = self._newest_index is None and remainder != 0
        self._newest_index, self.next_ns = index, -(-(index + 1) * self._in_ns // self._periods)
        return None if opens_quietly else index

    def newest_ns(self, time_ns: int) -> int:
        """Return the newest of these stamps at or before `time_ns`, a multiple of the tick; negative before 0."""
        index = time_ns * self._periods // self._in_ns
        boundary_ns = -(-index * self._in_ns // self._periods)
        return -(-boundary_ns // self._tick_ns) * self._tick_ns


class EncoderSample(NamedTuple):
    """The counters as read at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int
    wheel_rates_radps: Optional[Tuple[float, float]] = None  # left, right, measured by the controller


ShortDuration_s = Annotated[float, Between(0.0, 10.0, 's')]

# Number of sampled jitters, which are then repeated.
JITTERS = 1024

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

    def jitters_ns(self, period_s: float, seed: int) -> np.ndarray:
        """Return the delays of samples, by index modulo their number; a zero without jitter."""
        most_s = self.jitter_within_s(period_s)
        sampled_s = generator(seed, 'encoder_jitter').uniform(0.0, most_s, JITTERS if most_s else 1)
        return np.rint(sampled_s * NANOSECONDS_PER_SECOND).astype(np.int64)

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

    def __init__(self, params: ReportParams, period_s: float, seed: int, draw: int = 0) -> None:
        """Create the link of a draw for samples with period `period_s`."""
        self._params, self._period_ns = params, period_s * NANOSECONDS_PER_SECOND
        self._rng = generator(seed, f'encoder_reports_{draw}' if draw else 'encoder_reports')
        self._coming: List[Tuple[int, EncoderSample]] = []  # by arrival, then in order

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

    def pass_on(self, now_ns: int, samples: Sequence[EncoderSample]) -> List[EncoderSample]:
        """Send the samples since the last call; return those that arrive up to now, the newest joint stamp."""
        for sample in samples:
            for arrival_ns in self.arrivals_ns(sample.stamp_ns):
                stamp_ns = arrival_ns if self._params.stamps == 'arrival' else sample.stamp_ns
                self._coming.append((arrival_ns, sample._replace(stamp_ns=stamp_ns)))
        self._coming.sort(key=operator.itemgetter(0))
        arrived = [sample for arrival_ns, sample in self._coming if arrival_ns <= now_ns]
        del self._coming[: len(arrived)]
        return arrived


log = logging.getLogger(__name__)

# Counts wait for their speeds until more than this number wait, for at least this time: on a loaded host one topic
# delivers several messages before the other. Afterwards they are processed without speeds.
MOST_WAITING = 5
PATIENCE_S = 0.5

# Maximum number of speeds waiting for counts; older ones are dropped.
MOST_SPEEDS = 100

# A stamp further back than this starts a new run.
JUMP_NS = NANOSECONDS_PER_SECOND


class SpeedPairing:
    """Pairs messages with equal stamps, in either order of arrival.

    If speeds stop, reports wait once and are then not delayed until speeds are received again.
    """

    def __init__(self) -> None:
        self._counts: Deque[Tuple[EncoderSample, float]] = deque()  # waiting for speeds, with arrival time
        self._speeds: Dict[int, Tuple[float, float]] = {}  # by stamp, in the order of arrival
        self._newest_ns: Optional[int] = None  # of the counts
        self._are_speeds_coming = True

    def take_counts(self, counts: EncoderSample, now_s: float) -> List[EncoderSample]:
        """Add counts at a monotonic time (simulated time may pause); return the completed reports in order."""
        if self._newest_ns is not None and counts.stamp_ns < self._newest_ns - JUMP_NS:
            self._counts.clear()
            latest_ns = counts.stamp_ns + JUMP_NS  # speeds after the jump may be here already
            self._speeds = {stamp_ns: speeds for stamp_ns, speeds in self._speeds.items() if stamp_ns <= latest_ns}
        self._newest_ns = counts.stamp_ns
        self._counts.append((counts, now_s))
        if self._are_speeds_coming and len(self._counts) > MOST_WAITING and now_s - self._counts[0][1] > PATIENCE_S:
            self._are_speeds_coming = False
            log.warning('no measured speeds for %.1f s: the twist is by counts until they come', PATIENCE_S)
        return self._released()

    def take_speeds(self, stamp_ns: int, wheel_rates_radps: Tuple[float, float]) -> List[EncoderSample]:
        """Add the left and right speeds of a report; return the completed reports, as `take_counts`."""
        self._speeds[stamp_ns] = wheel_rates_radps
        if len(self._speeds) > MOST_SPEEDS:
            del self._speeds[next(iter(self._speeds))]
        self._are_speeds_coming = True
        return self._released()

    def _released(self) -> List[EncoderSample]:
        released = []
        while self._counts:
            counts, _ = self._counts[0]
            speeds = self._speeds.get(counts.stamp_ns)
            if speeds is None and self._are_speeds_coming and all(each <= counts.stamp_ns for each in self._speeds):
                break  # may still arrive: speeds of later counts have not
            while counts.stamp_ns in self._speeds:  # and earlier speeds, whose counts are lost
                del self._speeds[next(iter(self._speeds))]
            released.append(counts._replace(wheel_rates_radps=speeds))
            self._counts.popleft()
        return released
