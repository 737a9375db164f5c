"""Puts counts and measured speeds of one report together again, which come on two topics."""

from __future__ import annotations

import logging
from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.report_link import EncoderSample

log = logging.getLogger(__name__)

# Counts wait for their speeds until so many newer ones have come, and for so long at least: on a loaded host one topic
# brings several messages before the other its next one. Then they go on without them.
MOST_WAITING = 5
PATIENCE_S = 0.5

# Speeds that wait for their counts; older ones are dropped.
MOST_SPEEDS = 100

# Counts that are further back than this belong to a new run.
JUMP_NS = NANOSECONDS_PER_SECOND


class _Speeds(NamedTuple):
    stamp_ns: int
    wheel_rates_radps: Tuple[float, float]


class _Counts(NamedTuple):
    sample: EncoderSample
    came_s: float


class SpeedPairing:
    """Pairs by equal stamps. Each topic keeps its order; either message of a report may come first.

    Where speeds stop to come, reports wait for them once, and no more until they come again.
    """

    def __init__(self) -> None:
        self._counts: Deque[_Counts] = deque()  # without their speeds yet
        self._speeds: Deque[_Speeds] = deque(maxlen=MOST_SPEEDS)
        self._newest_ns: Optional[int] = None  # of the counts
        self._are_speeds_coming = True

    def take_counts(self, counts: EncoderSample, now_s: float) -> List[EncoderSample]:
        """Take the counts of a report that comes now, and return the reports that wait no longer, in their order.

        Args:
            counts: of the report.
            now_s: by a clock that never goes back, and not by simulated time, which may pause.
        """
        if self._newest_ns is not None and counts.stamp_ns < self._newest_ns - JUMP_NS:
            self._forget_before_jump(counts.stamp_ns)
        self._newest_ns = counts.stamp_ns
        self._counts.append(_Counts(counts, now_s))
        self._give_up_after_long(now_s)
        return self._released()

    def take_speeds(self, stamp_ns: int, wheel_rates_radps: Tuple[float, float]) -> List[EncoderSample]:
        """Take the wheels' speeds of a report, left and right; returns as `take_counts` does."""
        self._speeds.append(_Speeds(stamp_ns, wheel_rates_radps))
        self._are_speeds_coming = True
        return self._released()

    def _forget_before_jump(self, stamp_ns: int) -> None:
        """Drop what is left of before time jumped back; speeds of afterwards may have come already."""
        self._counts.clear()
        of_afterwards = [speeds for speeds in self._speeds if speeds.stamp_ns <= stamp_ns + JUMP_NS]
        self._speeds.clear()
        self._speeds.extend(of_afterwards)

    def _released(self) -> List[EncoderSample]:
        released = []
        while self._counts:
            counts = self._counts[0].sample
            speeds = self._speeds_of(counts.stamp_ns)
            if speeds is None and self._are_awaited(counts.stamp_ns):
                break
            released.append(counts._replace(wheel_rates_radps=speeds))
            self._counts.popleft()
        return released

    def _speeds_of(self, stamp_ns: int) -> Optional[Tuple[float, float]]:
        """Return the speeds with a stamp, and drop those that came before them; None where there are none."""
        if all(speeds.stamp_ns != stamp_ns for speeds in self._speeds):
            return None
        while True:
            speeds = self._speeds.popleft()
            if speeds.stamp_ns == stamp_ns:
                return speeds.wheel_rates_radps

    def _are_awaited(self, stamp_ns: int) -> bool:
        """Return whether the speeds of the oldest counts may still come: those of later ones have not."""
        return self._are_speeds_coming and all(speeds.stamp_ns <= stamp_ns for speeds in self._speeds)

    def _give_up_after_long(self, now_s: float) -> None:
        is_long = len(self._counts) > MOST_WAITING and now_s - self._counts[0].came_s > PATIENCE_S
        if is_long and self._are_speeds_coming:
            self._are_speeds_coming = False
            log.warning('no measured speeds for %.1f s: the twist is by counts until they come', PATIENCE_S)
