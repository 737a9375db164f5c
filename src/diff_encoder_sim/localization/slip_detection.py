"""Slip detection: the heading change by the wheels minus that by the gyroscope, over a window, against its covariance.

The same difference over the time before, without slip, gives the bias of the gyroscope. Both are weighted sums of
accumulated quantities, so that an error, such as that of a scale, is multiplied by the weighted sum of its quantity.
Counting is a bounded error: the heading change by counts is at most one count of each wheel off.

A gyroscope does not measure slip of both wheels by the same distance.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, NamedTuple

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors
from diff_encoder_sim.wheels.diagnostics import Diagnosis

LEARNING_S = 60.0  # mean age of the differences that give the bias
KEPT_PER_WINDOW = 60  # of reports, at most
LONGEST_SLIP_S = 2.5  # since the last window without slip began: later the gyroscope may be wrong
STANDING_S = 1.0  # without a count for longer, the robot stands
LONGEST_GAP_PERIODS = 5.0  # between rates; the turn in a longer one is unknown


class SlipState(NamedTuple):
    """Comparison over the window before a report."""

    is_slipping: bool = False
    difference_rad: float = 0.0  # heading change by the wheels minus that by the gyroscope
    limit_rad: float = math.inf  # of its absolute value without slip; infinite before the first window


class _Sums(NamedTuple):
    """Quantities accumulated until a report; only their differences are used."""

    time_s: float
    wheels_rad: float  # turn by the counts
    gyro_rad: float  # turn by the rates, with their bias
    forward_m: float  # of the axle's centre
    path_m: float  # of both wheels
    rate_radps: float

    def plus(self, weight: float, other: _Sums) -> _Sums:
        return _Sums._make([one + weight * of_other for one, of_other in zip(self, other)])


class SlipDetector:
    """Compares counts with rates of a gyroscope at each report; `is_gyro_better` while slip in `state` is short."""

    def __init__(self, params: FusionParams, wheels: WheelErrors, imu: ImuParams) -> None:
        self._params, self._wheels, self._gyroscope = params, wheels, imu.gyroscope
        self._bias_variance = imu.gyroscope.bias_std**2
        self._noise = imu.gyroscope.integral_variance(imu.rate)  # [rad^2/s]
        self._timing_std_s = 1.0 / imu.rate + imu.latency
        self._longest_gap_s = LONGEST_GAP_PERIODS / imu.rate + imu.latency
        left_rad, right_rad = (each / wheels.separation_m for each in wheels.m_per_count)
        self._count_rad, self._count_variance = left_rad + right_rad, (left_rad**2 + right_rad**2) / 12.0
        self._slips = self._reported = 0
        self.reset()

    def reset(self) -> None:
        """Start without reports and rates."""
        self._rate_ns, self._rate_radps, self._gyro_rad = -1, 0.0, 0.0
        self._restart()

    def _restart(self) -> None:
        self.state, self.is_gyro_better = SlipState(), False
        self._kept: Deque[_Sums] = deque()  # the first one is the start of the window
        self._travels_m, self._path_m = (0.0, 0.0), 0.0

    def take_gyro(self, stamp_ns: int, yaw_rate_radps: float) -> None:
        """Process a finite rate about the vertical axis; a long gap, or a step back, restarts the comparison."""
        interval_s = 1e-9 * (stamp_ns - self._rate_ns)
        if not 0.0 < interval_s <= self._longest_gap_s:
            self._restart()
        else:
            self._gyro_rad += 0.5 * interval_s * (self._rate_radps + yaw_rate_radps)
        self._rate_ns, self._rate_radps = stamp_ns, yaw_rate_radps

    def take_counts(self, stamp_ns: int, left_total: int, right_total: int) -> None:
        """Process accumulated counts, without wraps; stamps increase."""
        late_s = 1e-9 * (stamp_ns - self._rate_ns)
        if self._rate_ns < 0 or late_s > self._longest_gap_s:
            self._restart()
            return
        left_m, right_m = left_total * self._wheels.m_per_count[0], right_total * self._wheels.m_per_count[1]
        self._path_m += abs(left_m - self._travels_m[0]) + abs(right_m - self._travels_m[1])
        self._travels_m = left_m, right_m
        turns_rad = (right_m - left_m) / self._wheels.separation_m, self._gyro_rad + late_s * self._rate_radps
        end = _Sums(1e-9 * stamp_ns, *turns_rad, 0.5 * (left_m + right_m), self._path_m, self._rate_radps)
        kept, window_s = self._kept, self._params.slip_window - 1e-6
        if not kept:  # sums at the start of the last window without slip, and their moving mean, without times of slip
            self._clean = self._origin = end
        if not kept or end.time_s - kept[-1].time_s >= window_s / KEPT_PER_WINDOW:
            kept.append(end)
        while len(kept) > 1 and end.time_s - kept[1].time_s >= window_s:
            kept.popleft()
        if end.time_s - kept[0].time_s >= window_s:
            self._compare(kept[0], end)

    def _compare(self, start: _Sums, end: _Sums) -> None:
        window, before, was = end.plus(-1.0, start), self._clean.plus(-1.0, self._origin), self.state
        counted = 0.0 if before.time_s > STANDING_S and not before.path_m else 1.0  # at rest remainders are constant
        # The gain of a Kalman filter of the bias, whose measurement is the difference before.
        gain = self._bias_variance * before.time_s
        total = (gain + self._noise) * before.time_s + 2.0 * self._count_variance * counted
        weight = gain * window.time_s / total if total else 0.0
        self.state = self._difference(window, before, weight, counted * weight)
        self.is_gyro_better = self.state.is_slipping and end.time_s - self._clean.time_s < LONGEST_SLIP_S
        if self.state.is_slipping:
            self._slips += not was.is_slipping
            return
        if was.is_slipping:
            self._origin = self._origin.plus(1.0, start.plus(-1.0, self._clean))
        forgotten = min(1.0, (start.time_s - self._clean.time_s) / LEARNING_S)
        self._clean, self._origin = start, self._origin.plus(forgotten, start.plus(-1.0, self._origin))

    def _difference(self, window: _Sums, before: _Sums, weight: float, counted: float) -> SlipState:
        """Compare the window minus a weight of the difference before, and a weight of its error of counting."""
        wheels, sums = self._wheels, window.plus(-weight, before)
        variance = (
            self._bias_variance * sums.time_s**2
            + self._noise * (window.time_s + weight**2 * before.time_s)
            + (self._gyroscope.scale_error * sums.gyro_rad) ** 2
            + (self._timing_std_s * sums.rate_radps) ** 2
            + (wheels.turn_std * sums.wheels_rad) ** 2
            + (wheels.diameter_difference_std * sums.forward_m / wheels.separation_m) ** 2
            + wheels.travel_variance * (window.path_m + weight**2 * before.path_m) / wheels.separation_m**2
        )
        counting = self._count_variance * (1.0 + (1.0 + counted) ** 2 + counted**2)
        threshold, bound_rad = self._params.slip_threshold, self._count_rad * (1.0 + counted)
        limit_rad = min(threshold * math.sqrt(variance + counting), bound_rad + threshold * math.sqrt(variance))
        difference_rad = sums.wheels_rad - sums.gyro_rad
        return SlipState(abs(difference_rad) > limit_rad, difference_rad, limit_rad)

    def diagnose(self) -> Diagnosis:
        """Return the state; the warning covers the time since the last call."""
        slips, self._reported = self._slips - self._reported, self._slips
        warning = 'wheels slip: they turn the robot otherwise than the gyroscope' if slips or self.state[0] else ''
        _, difference_rad, limit_rad = self.state
        return Diagnosis(warning, {'slips': self._slips, 'difference [rad]': difference_rad, 'limit [rad]': limit_rad})
