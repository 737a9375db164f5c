"""From the readings of two counters to the pulses between them, across wraps and restarts."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.counter import count_difference, wrap_count
from diff_encoder_sim.wheels.counter_restart import is_restart
from diff_encoder_sim.wheels.odometry_params import OdometryParams

# Stamps of arrival may be nearer to each other than their samples, by so much: a jump is judged by what a wheel turns
# in this time at least.
STAMPS_OFF_BY_S = 0.05

# The speed before a jump is the mean over so much time at least, or over one interval: likewise.
SPEED_OVER_NS = 20_000_000


class Reading(NamedTuple):
    """Both counters at one instant."""

    stamp_ns: int
    left_pulses: int
    right_pulses: int


class CounterStep(NamedTuple):
    """What happened between two readings."""

    left_pulses: int
    right_pulses: int
    restart: str = ''  # why the counters are taken to have restarted; '' where they went on


class CounterSteps:
    """Turns each reading into the pulses since the one before."""

    def __init__(self, params: OdometryParams) -> None:
        self._modulus = params.counter_modulus
        self._ppr = params.counts_per_turn
        self._most_jumps = params.encoder.most_jump(self._ppr.left), params.encoder.most_jump(self._ppr.right)
        self._max_speed_radps, self._max_acceleration_radps2 = params.max_wheel_speed, params.max_wheel_acceleration
        self.reset()

    def reset(self) -> None:
        """Forget all readings."""
        self._last: Optional[Reading] = None
        self._totals: Deque[Reading] = deque([Reading(0, 0, 0)])  # those that the speed is between, since a start
        self.restarts = 0  # of counters

    def take(self, reading: Reading) -> Optional[CounterStep]:
        """Return the pulses since the reading before, whose stamp is older; None where there is none.

        A step faster than the wheels can turn is taken for a restart of the counters.
        """
        last, self._last = self._last, reading
        if last is None:
            return None
        step = self._step_between(last, reading)
        self._remember(reading.stamp_ns - last.stamp_ns, step.left_pulses, step.right_pulses)
        return step

    def _remember(self, duration_ns: int, left_pulses: int, right_pulses: int) -> None:
        total = self._totals[-1]
        now = Reading(total.stamp_ns + duration_ns, total.left_pulses + left_pulses, total.right_pulses + right_pulses)
        self._totals.append(now)
        while len(self._totals) > 2 and now.stamp_ns - self._totals[1].stamp_ns >= SPEED_OVER_NS:
            self._totals.popleft()

    def _step_between(self, last: Reading, reading: Reading) -> CounterStep:
        left_pulses = count_difference(reading.left_pulses, last.left_pulses, self._modulus)
        right_pulses = count_difference(reading.right_pulses, last.right_pulses, self._modulus)
        pulses, counts = (left_pulses, right_pulses), self._signed(reading)
        interval_s = (reading.stamp_ns - last.stamp_ns) / NANOSECONDS_PER_SECOND
        is_near_zero = self._is_near_zero(self._signed(last), counts, pulses, interval_s)
        if not is_near_zero and not self._is_implausible(pulses, max(interval_s, STAMPS_OFF_BY_S)):
            return CounterStep(left_pulses, right_pulses)
        self.restarts += 1
        bound = 'max_wheel_acceleration allows' if is_near_zero else 'max_wheel_speed'
        restart = f'{left_pulses} left and {right_pulses} right pulses in {interval_s:.3f} s are faster than {bound}'
        return CounterStep(*(counts if is_near_zero else (0, 0)), restart)

    def _is_near_zero(
        self, counts_before: Tuple[int, int], counts: Tuple[int, int], pulses: Tuple[int, int], interval_s: float
    ) -> bool:
        """Return whether the counters began anew at zero."""
        if len(self._totals) < 2:
            return False
        first, last = self._totals[0], self._totals[-1]
        span_s = (last.stamp_ns - first.stamp_ns) / NANOSECONDS_PER_SECOND
        share = interval_s / span_s
        went = (last.left_pulses - first.left_pulses) * share, (last.right_pulses - first.right_pulses) * share
        # From the middle of the one interval to that of the other.
        between_s = 0.5 * (span_s + interval_s)
        turns = self._max_acceleration_radps2 * between_s * interval_s / (2.0 * math.pi)
        left_jump, right_jump = self._most_jumps
        most_change = turns * self._ppr.left + left_jump, turns * self._ppr.right + right_jump
        return is_restart(counts_before, counts, pulses, went, most_change)

    def _is_implausible(self, pulses: Tuple[int, int], interval_s: float) -> bool:
        turns = self._max_speed_radps * interval_s / (2.0 * math.pi)
        return any(
            # A wheel that turns by less than a pulse may pass one.
            abs(count) - 1.0 - jump > turns * ppr
            for count, jump, ppr in zip(pulses, self._most_jumps, (self._ppr.left, self._ppr.right))
        )

    def _signed(self, reading: Reading) -> Tuple[int, int]:
        """Return the counters as those that count down from zero to below it."""
        return wrap_count(reading.left_pulses, self._modulus), wrap_count(reading.right_pulses, self._modulus)
