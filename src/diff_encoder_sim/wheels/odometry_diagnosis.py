"""What an odometry node can say about its encoders, for /diagnostics."""

from __future__ import annotations

import math
from typing import Iterator, Tuple

from diff_encoder_sim.wheels.count_rate import CountRate
from diff_encoder_sim.wheels.diagnosis import Diagnosis
from diff_encoder_sim.wheels.following_error import FollowingError
from diff_encoder_sim.wheels.lost_reports import LostReports
from diff_encoder_sim.wheels.wheel_odometry import WheelOdometry
from diff_encoder_sim.wheels.wheel_twist import wheel_speeds_mps

SIDES = ('left', 'right')


class OdometryDiagnosis:
    """Watches an odometry, its reports and its robot's commands."""

    def __init__(self, odometry: WheelOdometry, rate_hz: float) -> None:
        """Prepare for reports at `rate_hz`."""
        self._odometry, params = odometry, odometry.params
        self._radius_m, self._separation_m = 0.5 * params.wheel_diameter, params.wheel_separation
        turn, counts = 2.0 * math.pi, params.counts_per_turn
        self._following_error = FollowingError(
            (turn / counts.left, turn / counts.right), params.following_error_window, params.following_error_timeout
        )
        self._rate, self._lost, self._ignored = CountRate(0), LostReports(rate_hz), 0
        self._told = self._events()

    def restart(self) -> None:
        """Begin anew where odometry was reset; what has happened so far stays counted."""
        self._rate = CountRate(0)
        self._following_error.restart()
        self._told = self._events()

    def take_command(self, linear_mps: float, angular_radps: float) -> None:
        """Take a commanded twist."""
        left_mps, right_mps = wheel_speeds_mps(linear_mps, angular_radps, self._separation_m)
        self._following_error.take_command(left_mps / self._radius_m, right_mps / self._radius_m)

    def take_report(self, stamp_ns: int, is_used: bool) -> None:
        """Take note of a report, which odometry has used, or ignored because it is stale."""
        if not is_used:
            self._ignored += 1
            return
        counts = self._odometry.counts
        self._lost.take(stamp_ns)
        self._rate.take(stamp_ns, *counts)
        self._following_error.take_report(stamp_ns, *counts)

    def diagnose(self) -> Diagnosis:
        """Return the state at the newest report; warnings are of what has happened since the last call."""
        warning = '; '.join(self._warnings())
        self._told = self._events()
        lost, restarts = self._told
        values = {
            **{f'counts per second, {side}': value for side, value in zip(SIDES, self._rate.counts_per_s)},
            'reports per second': self._rate.reports_per_s,
            'lost reports': lost,
            'late or repeated reports': self._ignored,
            'counter restarts': restarts,
            **{
                f'following error, {side} [rad/s]': value
                for side, value in zip(SIDES, self._following_error.errors_radps)
            },
        }
        return Diagnosis(warning, values)

    def _events(self) -> Tuple[int, int]:
        """Return lost reports and counter restarts so far."""
        return self._lost.count, self._odometry.restarts

    def _warnings(self) -> Iterator[str]:
        lost, restarts = (now - told for now, told in zip(self._events(), self._told))
        if lost > 0:
            yield f'lost reports: {lost}'
        if restarts > 0:
            yield f'counter restarts: {restarts}'
        for side, lasts_s in zip(SIDES, self._following_error.lasts_s()):
            if lasts_s:
                yield f'{side} wheel has not followed the command for {lasts_s:.1f} s'
