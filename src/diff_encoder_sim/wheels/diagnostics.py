"""The state of encoders and odometry, for /diagnostics."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, Dict, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.counter import count_difference
from diff_encoder_sim.wheels.covariance import quantisation_covariance
from diff_encoder_sim.wheels.odometry import WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import USUAL_MOTION_NOISE, OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


class Diagnosis(NamedTuple):
    """A state, and a warning about events since the previous diagnosis."""

    warning: str  # empty if OK
    values: Dict[str, float]


# Fraction of the lateness carried over to the next report: jitter cancels, and a slow clock is not counted as loss.
LATENESS_KEPT = 0.98


class ReportRate:
    """Counts and reports per second of stamps, zero during the first second; and the number of lost reports."""

    def __init__(self, rate_hz: float, counter_modulus: int = 0) -> None:
        """Prepare for reports at `rate_hz`."""
        self._rate_hz, self._modulus = rate_hz, counter_modulus
        self._missing = 0
        self.restart()

    def restart(self) -> None:
        """Restart when counts do; lost reports stay counted."""
        self._newest: Optional[Tuple[int, int, int]] = None  # stamp, left, right
        self.values = {'counts per second, left': 0.0, 'counts per second, right': 0.0, 'reports per second': 0.0}

    @property
    def lost(self) -> int:
        """Return the number of lost reports."""
        return max(self._missing, 0)

    def take(self, stamp_ns: int, left_count: int, right_count: int) -> None:
        """Add a report; a stamp that goes back restarts the second."""
        newest, self._newest = self._newest, (stamp_ns, left_count, right_count)
        if newest is None or stamp_ns < newest[0]:
            self._since_ns, self._sums, self._late = stamp_ns, [0, 0, 0], 0.0
            return
        periods = (stamp_ns - newest[0]) * self._rate_hz / NANOSECONDS_PER_SECOND + LATENESS_KEPT * self._late
        passed = round(periods)  # 0 for a report right after a late one
        self._late = periods - passed
        self._missing += passed - 1
        self._sums[0] += count_difference(left_count, newest[1], self._modulus)
        self._sums[1] += count_difference(right_count, newest[2], self._modulus)
        self._sums[2] += 1
        over_s = (stamp_ns - self._since_ns) / NANOSECONDS_PER_SECOND
        if over_s >= 1.0:
            self.values = {key: total / over_s for key, total in zip(self.values, self._sums)}
            self._since_ns, self._sums = stamp_ns, [0, 0, 0]


class EncoderDiagnosis:
    """Monitors the reports of an encoder and its dropped joint messages."""

    def __init__(self, params: EncoderParams) -> None:
        self._rate = ReportRate(params.rate, params.counter_modulus)
        self._dropped = self._reported = 0

    def take_report(self, sample: EncoderSample) -> None:
        """Add a report."""
        self._rate.take(*sample[:3])

    def take_fault(self) -> None:
        """Add a dropped joint message."""
        self._dropped += 1

    def diagnose(self) -> Diagnosis:
        """Return the state; the warning covers the time since the last call."""
        dropped, self._reported = self._dropped - self._reported, self._dropped
        warning = f'dropped joint messages: {dropped}' if dropped else ''
        return Diagnosis(warning, {**self._rate.values, 'dropped joint messages': self._dropped})


# Averaging time of speeds, long enough for a coarse encoder.
MEAN_OVER_NS = NANOSECONDS_PER_SECOND // 4


class FollowingError:
    """Measured minus commanded speed of a wheel, as motor drives compute it.

    A command expires after `timeout_s`, when many robots stop.
    """

    def __init__(self, rad_per_count: float, window_radps: float, timeout_s: float) -> None:
        """Start without a command; tolerate errors of one count, of the window, and up to the timeout."""
        self._rad_per_count, self._window_radps = rad_per_count, window_radps
        self._timeout_ns = timeout_s * NANOSECONDS_PER_SECOND
        self._command_radps, self._is_new = 0.0, False
        self._command_ns: Optional[int] = None
        self.restart()

    def restart(self) -> None:
        """Restart when counts do; the newest command stays."""
        self._commanded_rad = 0.0  # accumulated
        self._travels: Deque[Tuple[int, float]] = deque()  # stamps, and excess of the measured angles [rad]
        self._within_ns = self._newest_ns = 0  # last time that the error was in the window; of the newest report
        self.error_radps = 0.0

    def take_command(self, radps: float) -> None:
        """Set the commanded speed; values that are not finite are ignored."""
        if math.isfinite(radps):
            self._command_radps, self._is_new = radps, True

    def take_report(self, stamp_ns: int, count: int) -> None:
        """Add the count of a report, since the start."""
        if self._is_new:
            self._command_ns, self._is_new = stamp_ns, False
        if self._command_ns is None or not 0 <= stamp_ns - self._command_ns <= self._timeout_ns:
            self._command_ns = None
            self.restart()
            return
        last_ns = self._travels[-1][0] if self._travels else stamp_ns
        self._commanded_rad += self._command_radps * ((stamp_ns - last_ns) / NANOSECONDS_PER_SECOND)
        too_far_rad = count * self._rad_per_count - self._commanded_rad
        self._travels.append((stamp_ns, too_far_rad))
        while len(self._travels) > 2 and stamp_ns - self._travels[1][0] >= MEAN_OVER_NS:
            self._travels.popleft()
        self._newest_ns = stamp_ns
        first_ns, before_rad = self._travels[0]
        if stamp_ns - first_ns >= MEAN_OVER_NS:
            over_s = (stamp_ns - first_ns) / NANOSECONDS_PER_SECOND
            self.error_radps = (too_far_rad - before_rad) / over_s
            if abs(self.error_radps) > self._window_radps + self._rad_per_count / over_s:
                return
        self._within_ns = stamp_ns

    @property
    def lasts_s(self) -> float:
        """Return the duration of the error if it exceeds the timeout; else 0."""
        lasts_ns = self._newest_ns - self._within_ns
        return lasts_ns / NANOSECONDS_PER_SECOND if lasts_ns > self._timeout_ns else 0.0


class OdometryDiagnosis:
    """Monitors odometry, its reports and the robot's commands."""

    def __init__(self, odometry: WheelOdometry, rate_hz: float) -> None:
        """Prepare for reports at `rate_hz`."""
        self._odometry, params = odometry, odometry.params
        watched = params.following_error_window, params.following_error_timeout
        self._following = {
            side: FollowingError(2.0 * math.pi / counts, *watched) for side, counts in params.counts_per_turn
        }
        self._rate, self._ignored = ReportRate(rate_hz), 0
        self.restart()

    def restart(self) -> None:
        """Restart after a reset of odometry; event counts are kept."""
        self._rate.restart()
        for wheel in self._following.values():
            wheel.restart()
        self._reported = self._rate.lost, self._odometry.pulses.restarts

    def take_command(self, linear_mps: float, angular_radps: float) -> None:
        """Set the commanded twist."""
        params = self._odometry.params
        speeds_mps = wheel_speeds_mps(linear_mps, angular_radps, params.wheel_separation)
        for wheel, mps, radius_m in zip(self._following.values(), speeds_mps, params.wheel_diameter.radii_m):
            wheel.take_command(mps / radius_m)

    def take_report(self, stamp_ns: int, is_used: bool) -> None:
        """Add a report; `is_used` is False if odometry ignored it as stale."""
        if not is_used:
            self._ignored += 1
            return
        counts = self._odometry.pulses.counts
        self._rate.take(stamp_ns, *counts)
        for wheel, count in zip(self._following.values(), counts):
            wheel.take_report(stamp_ns, count)

    def diagnose(self) -> Diagnosis:
        """Return the state at the newest report; warnings cover the time since the last call."""
        before, self._reported = self._reported, (self._rate.lost, self._odometry.pulses.restarts)
        lost, restarts = self._reported
        warnings = [f'lost reports: {lost - before[0]}'] if lost > before[0] else []
        warnings += [f'counter restarts: {restarts - before[1]}'] if restarts > before[1] else []
        warnings += [
            f'{side} wheel has not followed the command for {wheel.lasts_s:.1f} s'
            for side, wheel in self._following.items()
            if wheel.lasts_s
        ]
        events = {'lost reports': lost, 'late or repeated reports': self._ignored, 'counter restarts': restarts}
        errors = {f'following error, {side} [rad/s]': wheel.error_radps for side, wheel in self._following.items()}
        return Diagnosis('; '.join(warnings), {**self._rate.values, **events, **errors})


STRAIGHT_M = 20.0  # reference distance: the paper's straight test


def hidden_encoder(params: OdometryParams) -> str:
    """Return a warning if the default motion noise exceeds the encoder's error on a straight line; else ''."""
    encoder_m = encoder_lateral_std(params)
    noise_m = math.sqrt(2.0 * USUAL_MOTION_NOISE * STRAIGHT_M**3 / 3.0) / params.wheel_separation
    if noise_m <= encoder_m:
        return ''
    return (
        f"/odom's covariance hides the encoder: after {STRAIGHT_M:g} m straight ahead it states {1e3 * noise_m:.0f} mm "
        f'across for slip of {USUAL_MOTION_NOISE:g} m^2/m, the default, and {1e3 * encoder_m:.3g} mm for the encoder; '
        "set config.motion_noise, or simulator.wheel_errors.slip_noise in the robot file, to the robot's own"
    )


def encoder_lateral_std(params: OdometryParams) -> float:
    """Return the lateral standard deviation [m] due to the encoder after a straight line."""
    end = Pose2D(STRAIGHT_M, 0.0, 0.0)
    return math.sqrt(quantisation_covariance(end, params.reading_variances_m2, params.wheel_separation).yy)
