"""Pairs the counts and measured speeds of each report, received on two topics."""

from __future__ import annotations

import logging
from collections import deque
from typing import Deque, Dict, List, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.report_link import EncoderSample

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
        """Add the counts of a report, and return the completed reports in order.

        Args:
            counts: of the report.
            now_s: monotonic time; not simulated time, which may pause.
        """
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
