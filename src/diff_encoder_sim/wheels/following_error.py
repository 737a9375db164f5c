"""Wheels that do not do what is commanded: blocked, pushed, or with an encoder that miscounts."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# Speeds are means over as long, so that counts of a coarse encoder make one.
MEAN_OVER_NS = NANOSECONDS_PER_SECOND // 4

PerSide = Tuple[float, float]  # left, right


class _Travel(NamedTuple):
    """The wheels at one report: turned since some time [rad], by counts and by commands."""

    stamp_ns: int
    measured: PerSide
    commanded: PerSide


class FollowingError:
    """The wheels' measured minus their commanded speeds, as drives compute it.

    A command that has not been renewed for as long as an error may last is none: many robots stop then.
    """

    def __init__(self, rad_per_count: PerSide, window_radps: float, timeout_s: float) -> None:
        """Prepare to compare.

        Args:
            rad_per_count: of each wheel; what a count more or less makes of a mean is no error.
            window_radps: errors up to this are none.
            timeout_s: how long one may last.
        """
        self._rad_per_count, self._window_radps = rad_per_count, window_radps
        self._timeout_ns = timeout_s * NANOSECONDS_PER_SECOND
        self._command: PerSide = (0.0, 0.0)
        self._is_new = False
        self._command_ns: Optional[int] = None
        self.restart()

    def restart(self) -> None:
        """Begin anew, as where counts do; the newest command stands."""
        self._travels: Deque[_Travel] = deque()
        self._within_ns = (0, 0)  # when the error of each wheel was in the window last
        self._newest_ns = 0
        self.errors_radps: PerSide = (0.0, 0.0)

    def take_command(self, left_radps: float, right_radps: float) -> None:
        """Take the commanded speeds of the wheels; such as are not finite are ignored."""
        if math.isfinite(left_radps) and math.isfinite(right_radps):
            self._command, self._is_new = (left_radps, right_radps), True

    def take_report(self, stamp_ns: int, left_count: int, right_count: int) -> None:
        """Take the counts since the start, left and right, of a report."""
        if self._is_new:
            self._command_ns, self._is_new = stamp_ns, False
        if self._command_ns is None or not 0 <= stamp_ns - self._command_ns <= self._timeout_ns:
            self._command_ns = None
            self.restart()
            return
        self._newest_ns = stamp_ns
        measured = left_count * self._rad_per_count[0], right_count * self._rad_per_count[1]
        self._travels.append(_Travel(stamp_ns, measured, self._commanded_until(stamp_ns)))
        while len(self._travels) > 2 and stamp_ns - self._travels[1].stamp_ns >= MEAN_OVER_NS:
            self._travels.popleft()
        self._compare(stamp_ns)

    def lasts_s(self) -> PerSide:
        """Return for how long each wheel's error has lasted up to now, where that is longer than it may; else 0."""
        left, right = (
            lasts_ns / NANOSECONDS_PER_SECOND if lasts_ns > self._timeout_ns else 0.0
            for lasts_ns in (self._newest_ns - within_ns for within_ns in self._within_ns)
        )
        return left, right

    def _commanded_until(self, stamp_ns: int) -> PerSide:
        if not self._travels:
            return 0.0, 0.0
        last = self._travels[-1]
        passed_s = (stamp_ns - last.stamp_ns) / NANOSECONDS_PER_SECOND
        left, right = (turned + speed * passed_s for turned, speed in zip(last.commanded, self._command))
        return left, right

    def _compare(self, stamp_ns: int) -> None:
        first, last = self._travels[0], self._travels[-1]
        over_s = (last.stamp_ns - first.stamp_ns) / NANOSECONDS_PER_SECOND
        if last.stamp_ns - first.stamp_ns < MEAN_OVER_NS:
            self._within_ns = stamp_ns, stamp_ns
            return
        left, right = (
            ((last.measured[side] - first.measured[side]) - (last.commanded[side] - first.commanded[side])) / over_s
            for side in (0, 1)
        )
        self.errors_radps = left, right
        left_ns, right_ns = (
            stamp_ns if abs(error) <= self._window_radps + rad / over_s else since_ns
            for error, rad, since_ns in zip(self.errors_radps, self._rad_per_count, self._within_ns)
        )
        self._within_ns = left_ns, right_ns
