"""Counters of finite width: their wrap, and the pulses between two readings, across wraps and restarts."""

from __future__ import annotations

import logging
from typing import Any, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.kernels import callable_by_kernels, compiled

log = logging.getLogger(__name__)


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


class CounterLimits(NamedTuple):
    """Limits of counters and wheels."""

    modulus: int  # counter states; 0: no wrap
    left_speed: float  # [counts/s]
    right_speed: float
    left_acceleration: float  # [counts/s^2]
    right_acceleration: float
    left_jump: float  # largest change of a reading without motion [counts]
    right_jump: float


class Counters(NamedTuple):
    """Both counters at a reading. Totals are a stamp [ns] and the left and right pulses since the first reading."""

    counts: Tuple[int, int]  # left, right; wrapped
    total: Tuple[int, int, int]
    middle: Tuple[int, int, int]  # total less than SPEED_OVER_NS before
    first: Tuple[int, int, int]  # start of the speed measurement


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
def first_counters(limits: CounterLimits, stamp_ns: int, left_count: int, right_count: int) -> Counters:
    """Return the counters at the first reading."""
    counts, total = (wrap_count(left_count, limits.modulus), wrap_count(right_count, limits.modulus)), (stamp_ns, 0, 0)
    return Counters(counts, total, total, total)


@callable_by_kernels
def _near(left: float, right: float, left_most: float, right_most: float) -> bool:
    """Return whether the pulses of both wheels are within their limits and the rounding."""
    return abs(left) <= left_most + ROUNDING_PULSES and abs(right) <= right_most + ROUNDING_PULSES


@callable_by_kernels
def _pulses(limits: CounterLimits, before: Counters, interval_ns: int, counts: Tuple[int, int]) -> Tuple[int, int, int]:
    """Return the left and right pulses since a reading, and the cause if the counters restarted.

    A restart at zero is detected if both counters are within the possible rotation of zero and continuing would exceed
    the limits of a wheel. One controller has both counters, so a jump of a single counter is not a restart. A step
    faster than the wheels can turn is a restart, too; its pulses are lost.
    """
    left = count_difference(counts[0], before.counts[0], limits.modulus)
    right = count_difference(counts[1], before.counts[1], limits.modulus)
    interval_s, span_ns = interval_ns * 1e-9, before.total[0] - before.first[0]
    if span_ns and (left or right):
        left_went = (before.total[1] - before.first[1]) * (interval_ns / span_ns)
        right_went = (before.total[2] - before.first[2]) * (interval_ns / span_ns)
        # Speeds refer to the middles of the two intervals.
        accelerated_s2 = 0.5 * (span_ns * 1e-9 + interval_s) * interval_s
        left_change = accelerated_s2 * limits.left_acceleration + limits.left_jump
        right_change = accelerated_s2 * limits.right_acceleration + limits.right_jump
        if not _near(left - left_went, right - right_went, left_change, right_change):
            is_near = _near(*counts, abs(left_went) + left_change, abs(right_went) + right_change)
            if is_near and not _near(*before.counts, left_change, right_change):
                return counts[0], counts[1], NEAR_ZERO
    at_least_s = max(interval_s, STAMPS_OFF_BY_S)
    # A rotation of less than one pulse can cross an edge.
    is_left_too_fast = abs(left) - 1.0 - limits.left_jump > limits.left_speed * at_least_s
    if is_left_too_fast or abs(right) - 1.0 - limits.right_jump > limits.right_speed * at_least_s:
        return 0, 0, TOO_FAST
    return left, right, WENT_ON


@callable_by_kernels
def next_counters(
    limits: CounterLimits, before: Counters, stamp_ns: int, left_count: int, right_count: int
) -> Tuple[Counters, int]:
    """Return the counters at a later reading, and the cause if they restarted since the previous one."""
    last_ns, last_left, last_right = before.total
    counts = (wrap_count(left_count, limits.modulus), wrap_count(right_count, limits.modulus))
    left, right, cause = _pulses(limits, before, stamp_ns - last_ns, counts)
    total, middle, first = (stamp_ns, last_left + left, last_right + right), before.middle, before.first
    if stamp_ns - middle[0] >= SPEED_OVER_NS:
        middle, first = total, middle
    return Counters(counts, total, middle, first), cause


def restart_text(limits: CounterLimits, before: Counters, after: Counters, cause: int) -> str:
    """Describe a restart between two readings, for a warning."""
    left, right = (count_difference(*pair, limits.modulus) for pair in zip(after.counts, before.counts))
    interval_s = (after.total[0] - before.total[0]) / 1e9
    return f'{left} left and {right} right pulses in {interval_s:.3f} s are faster than {CAUSES[cause]}'


class PulseTotals:
    """Counts the pulses of both wheels since the first reading, across wraps and restarts, which it logs."""

    def __init__(self, limits: CounterLimits) -> None:
        self._limits = limits
        self.reset()

    def reset(self) -> None:
        """Restart with the next reading."""
        self._counters: Optional[Counters] = None
        self.restarts = 0

    @property
    def counts(self) -> Tuple[int, int]:
        """Return the left and right pulses at the last reading."""
        return (0, 0) if self._counters is None else self._counters.total[1:]

    def read(self, stamp_ns: int, left_count: int, right_count: int) -> Tuple[int, int, int]:
        """Return the stamp, and the left and right pulses, at a reading later than the one before."""
        before = self._counters
        if before is None:
            self._counters = first_counters(self._limits, stamp_ns, left_count, right_count)
        else:
            self._counters, cause = next_counters(self._limits, before, stamp_ns, left_count, right_count)
            if cause:
                self.restarts += 1
                text = restart_text(self._limits, before, self._counters, cause)
                log.warning('%s: taken as a counter restart, the pose is kept', text, extra=EVENT)
        return self._counters.total


@compiled(nogil=True)
def totals_of(limits: CounterLimits, stamps_ns: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return (draws, m, 2) pulses since the first report, by (draws, m) stamps and (draws, m, 2) counts.

    Stale reports are ignored.
    """
    draws, reports = stamps_ns.shape
    totals = np.zeros((draws, reports, 2))
    for draw in range(draws if reports else 0):
        counters = first_counters(limits, stamps_ns[draw, 0], counts[draw, 0, 0], counts[draw, 0, 1])
        for report in range(1, reports):
            if stamps_ns[draw, report] > counters.total[0]:
                left_count, right_count = counts[draw, report, 0], counts[draw, report, 1]
                counters, _ = next_counters(limits, counters, stamps_ns[draw, report], left_count, right_count)
            totals[draw, report, 0], totals[draw, report, 1] = counters.total[1], counters.total[2]
    return totals
