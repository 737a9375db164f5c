"""Counters of finite width: their wrap, and the pulses between two readings, across wraps and restarts."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, Deque, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import callable_by_kernels, compiled
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


@callable_by_kernels
def wrap_count(pulses: Any, modulus: int) -> Any:
    """Wrap counts, a scalar or an array, into [-modulus/2, modulus/2), as a two's-complement counter does.

    With a modulus of 0 the counter never wraps.
    """
    if modulus == 0:
        return pulses
    half = modulus // 2
    return (pulses + half) % modulus - half


@callable_by_kernels
def count_difference(newer: int, older: int, modulus: int) -> Any:
    """Return the pulses between two readings of a wrapping counter, in the direction with fewer of them.

    Correct for fewer than modulus/2 pulses between readings, for counters with sign or in [0, modulus).
    """
    return wrap_count(newer - older, modulus)


class Reading(NamedTuple):
    """Both counters at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int


class CounterStep(NamedTuple):
    """The pulses between two readings."""

    left_pulses: int
    right_pulses: int
    interval_s: float
    restart: str = ''  # cause of a detected counter restart; '' for none


class CounterLimits(NamedTuple):
    """Limits of counters and wheels."""

    modulus: int  # counter states; 0: no wrap
    left_per_turn: float  # counts
    right_per_turn: float
    left_jump: float  # largest change of a reading without motion [counts]
    right_jump: float
    max_speed_radps: float
    max_acceleration_radps2: float


# Rounding to whole pulses adds one pulse at each end of an interval and of the previous one.
ROUNDING_PULSES = 2.0

# Arrival stamps may be closer together than their samples, by up to this: a jump is compared with the rotation in at
# least this time.
STAMPS_OFF_BY_S = 0.05

# The speed before a jump is the mean over at least this time, or over one interval.
SPEED_OVER_NS = 20_000_000

# Causes of a detected counter restart.
WENT_ON, NEAR_ZERO, TOO_FAST = range(3)
CAUSES = ('', 'max_wheel_acceleration allows', 'max_wheel_speed')


@callable_by_kernels
def _near(left: float, right: float, left_most: float, right_most: float) -> bool:
    """Return whether the pulses of both wheels are within their limits and the rounding."""
    return abs(left) <= left_most + ROUNDING_PULSES and abs(right) <= right_most + ROUNDING_PULSES


@callable_by_kernels
def counted_between(
    limits: CounterLimits,
    before: Tuple[int, int],
    now: Tuple[int, int],
    interval_ns: int,
    span_ns: int,
    went: Tuple[int, int],
) -> Tuple[int, int, int]:
    """Return the left and right pulses between two readings, and the cause if the counters restarted between them.

    A restart at zero is detected if both counters are within the possible rotation of zero and continuing would exceed
    the limits of a wheel. One controller has both counters, so a jump of a single counter is not a restart. A step
    faster than the wheels can turn is a restart, too; its pulses are lost.

    Args:
        limits: of counters and wheels.
        before: left and right counters at the last reading.
        now: left and right counters at this reading.
        interval_ns: time between the readings.
        span_ns: time before the last reading with measured speed; 0: unknown.
        went: left and right pulses in the span.
    """
    left = count_difference(now[0], before[0], limits.modulus)
    right = count_difference(now[1], before[1], limits.modulus)
    interval_s = interval_ns / 1e9
    if span_ns and (left or right):
        left_now, right_now = wrap_count(now[0], limits.modulus), wrap_count(now[1], limits.modulus)
        span_s = span_ns / 1e9
        left_went, right_went = went[0] * (interval_s / span_s), went[1] * (interval_s / span_s)
        # Speeds refer to the middles of the two intervals.
        turns = limits.max_acceleration_radps2 * (0.5 * (span_s + interval_s)) * interval_s / (2.0 * math.pi)
        left_change = turns * limits.left_per_turn + limits.left_jump
        right_change = turns * limits.right_per_turn + limits.right_jump
        is_near = _near(left_now, right_now, abs(left_went) + left_change, abs(right_went) + right_change)
        left_before, right_before = wrap_count(before[0], limits.modulus), wrap_count(before[1], limits.modulus)
        if (
            is_near
            and not _near(left_before, right_before, left_change, right_change)
            and not _near(left - left_went, right - right_went, left_change, right_change)
        ):
            return left_now, right_now, NEAR_ZERO
    turns = limits.max_speed_radps * max(interval_s, STAMPS_OFF_BY_S) / (2.0 * math.pi)
    # A rotation of less than one pulse can cross an edge.
    if abs(left) - 1.0 - limits.left_jump > turns * limits.left_per_turn:
        return 0, 0, TOO_FAST
    if abs(right) - 1.0 - limits.right_jump > turns * limits.right_per_turn:
        return 0, 0, TOO_FAST
    return left, right, WENT_ON


class CounterSteps:
    """Converts readings to pulses since the previous reading."""

    def __init__(self, limits: CounterLimits) -> None:
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Forget all readings."""
        self._last: Optional[Reading] = None
        self._totals: Deque[Reading] = deque()  # those that the speed is between, since a start
        self.restarts = 0  # of counters

    @property
    def total(self) -> Reading:
        """Return the pulses since the first reading, at the newest one."""
        return self._totals[-1]

    def take(self, reading: Reading) -> Optional[CounterStep]:
        """Return the pulses since the previous reading, which must be older; None for the first.

        A step faster than the wheels can turn is handled as a counter restart.
        """
        last, self._last, totals = self._last, reading, self._totals
        if last is None:
            totals.append(Reading(reading.stamp_ns, 0, 0))
            return None
        (first_ns, first_left, first_right), (total_ns, total_left, total_right) = totals[0], totals[-1]
        interval_ns, went = reading.stamp_ns - last.stamp_ns, (total_left - first_left, total_right - first_right)
        left, right, cause = counted_between(
            self._limits, last[1:], reading[1:], interval_ns, total_ns - first_ns, went
        )
        totals.append(Reading(reading.stamp_ns, total_left + left, total_right + right))
        while len(totals) > 2 and reading.stamp_ns - totals[1].stamp_ns >= SPEED_OVER_NS:
            totals.popleft()
        interval_s = interval_ns / NANOSECONDS_PER_SECOND
        if cause == WENT_ON:
            return CounterStep(left, right, interval_s)
        self.restarts += 1
        jumps = (count_difference(*counts, self._limits.modulus) for counts in zip(reading[1:], last[1:]))
        text = '{} left and {} right pulses in {:.3f} s are faster than {}'
        return CounterStep(left, right, interval_s, text.format(*jumps, interval_s, CAUSES[cause]))


@compiled(nogil=True)
def totals_of(limits: CounterLimits, stamps_ns: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return (draws, m, 2) pulses since the first report, equal to the sums of `CounterSteps`.

    Args:
        limits: of counters and wheels.
        stamps_ns: (draws, m); stale reports are ignored.
        counts: (draws, m, 2).
    """
    draws, reports = stamps_ns.shape
    totals = np.zeros((draws, reports, 2))
    newest_ns = np.zeros(reports, np.int64)
    for draw in range(draws if reports else 0):
        first, last = 0, 0  # the reports that the speed is between; those that are stale are as the one before
        newest_ns[0] = stamps_ns[draw, 0]
        for report in range(1, reports):
            totals[draw, report] = totals[draw, report - 1]
            newest_ns[report] = newest_ns[report - 1]
            interval_ns = stamps_ns[draw, report] - stamps_ns[draw, last]
            if interval_ns <= 0:
                continue
            before = (counts[draw, last, 0], counts[draw, last, 1])
            now = (counts[draw, report, 0], counts[draw, report, 1])
            went = (totals[draw, last, 0] - totals[draw, first, 0], totals[draw, last, 1] - totals[draw, first, 1])
            span_ns = newest_ns[last] - newest_ns[first]
            left, right, _ = counted_between(limits, before, now, interval_ns, span_ns, went)
            totals[draw, report, 0] += left
            totals[draw, report, 1] += right
            newest_ns[report], last = stamps_ns[draw, report], report
            while first + 1 < report and newest_ns[report] - newest_ns[first + 1] >= SPEED_OVER_NS:
                first += 1
    return totals
