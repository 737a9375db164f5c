"""The state of encoders and odometry, for /diagnostics."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, Dict, Iterator, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.counter import count_difference
from diff_encoder_sim.wheels.covariance import quantisation_covariance
from diff_encoder_sim.wheels.odometry import WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import USUAL_MOTION_NOISE, OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample


class Diagnosis(NamedTuple):
    """A state, and what is wrong with it."""

    warning: str  # empty where nothing is
    values: Dict[str, float]


OVER_NS = NANOSECONDS_PER_SECOND


class CountRate:
    """Counts each second of stamps anew; zero before the first is over."""

    def __init__(self, counter_modulus: int) -> None:
        self._modulus = counter_modulus
        self._newest: Optional[Tuple[int, int, int]] = None  # stamp, left, right
        self._begin(0)
        self.counts_per_s = (0.0, 0.0)  # left, right
        self.reports_per_s = 0.0

    def take(self, stamp_ns: int, left_count: int, right_count: int) -> None:
        """Take a report; after a stamp that goes back the second begins anew."""
        newest, self._newest = self._newest, (stamp_ns, left_count, right_count)
        if newest is None or stamp_ns < newest[0]:
            self._begin(stamp_ns)
            return
        self._reports += 1
        self._left += count_difference(left_count, newest[1], self._modulus)
        self._right += count_difference(right_count, newest[2], self._modulus)
        if stamp_ns - self._since_ns >= OVER_NS:
            over_s = (stamp_ns - self._since_ns) / NANOSECONDS_PER_SECOND
            self.counts_per_s = self._left / over_s, self._right / over_s
            self.reports_per_s = self._reports / over_s
            self._begin(stamp_ns)

    def _begin(self, stamp_ns: int) -> None:
        self._since_ns, self._reports, self._left, self._right = stamp_ns, 0, 0, 0


class EncoderDiagnosis:
    """Watches the reports of an encoder, and the joint messages that it has dropped."""

    def __init__(self, counter_modulus: int) -> None:
        self._rate = CountRate(counter_modulus)
        self._dropped = self._told = 0

    def take_report(self, sample: EncoderSample) -> None:
        """Take note of a report."""
        self._rate.take(*sample[:3])

    def take_fault(self) -> None:
        """Take note of a joint message that was dropped."""
        self._dropped += 1

    def diagnose(self) -> Diagnosis:
        """Return the state; a warning is of what has happened since the last call."""
        dropped, self._told = self._dropped - self._told, self._dropped
        left, right = self._rate.counts_per_s
        values = {
            'counts per second, left': left,
            'counts per second, right': right,
            'reports per second': self._rate.reports_per_s,
            'dropped joint messages': self._dropped,
        }
        return Diagnosis(f'dropped joint messages: {dropped}' if dropped else '', values)


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


# How much of its lateness a report hands on to the next: jitter cancels, and a slow clock is not taken for loss.
LATENESS_KEPT = 0.98


class LostReports:
    """Compares stamps with the rate at which reports should come."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._newest_ns: Optional[int] = None
        self._late = 0.0  # the newest report, in periods
        self._missing = 0

    @property
    def count(self) -> int:
        """Return how many have not come so far."""
        return max(self._missing, 0)

    def take(self, stamp_ns: int) -> None:
        """Take the stamp of a report; one that goes back begins anew, and keeps the count."""
        newest_ns, self._newest_ns = self._newest_ns, stamp_ns
        if newest_ns is None or stamp_ns < newest_ns:
            self._late = 0.0
            return
        periods = (stamp_ns - newest_ns) * self._rate_hz / NANOSECONDS_PER_SECOND + LATENESS_KEPT * self._late
        passed = round(periods)  # none for one that comes right after a late one
        self._late = periods - passed
        self._missing += passed - 1


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


STRAIGHT_M = 20.0  # the path by which the two are compared: the paper's straight test


def hidden_encoder(params: OdometryParams) -> str:
    """Return a line where the usual motion noise hides the encoder after a straight line; '' where it does not.

    Args:
        params: of odometry whose motion noise nobody gave.
    """
    encoder_m, noise_m = encoder_lateral_std(params), noise_lateral_std(USUAL_MOTION_NOISE, params.wheel_separation)
    if noise_m <= encoder_m:
        return ''
    return (
        f"/odom's covariance hides the encoder: after {STRAIGHT_M:g} m straight ahead it states {1e3 * noise_m:.0f} mm "
        f'across for slip of {USUAL_MOTION_NOISE:g} m^2/m, the default, and {1e3 * encoder_m:.3g} mm for the encoder; '
        "set config.motion_noise, or simulator.wheel_errors.slip_noise in the robot file, to the robot's own"
    )


def encoder_lateral_std(params: OdometryParams) -> float:
    """Return the standard deviation across [m] that the encoder's counts cause after a straight line."""
    end = Pose2D(STRAIGHT_M, 0.0, 0.0)
    covariance = quantisation_covariance(end, *params.reading_variances_m2, 0.0, params.wheel_separation)
    return math.sqrt(covariance.yy)


def noise_lateral_std(motion_noise: float, wheel_separation_m: float) -> float:
    """Return the standard deviation across [m] that motion noise [m^2/m] causes after a straight line."""
    return math.sqrt(2.0 * motion_noise * STRAIGHT_M**3 / 3.0) / wheel_separation_m
