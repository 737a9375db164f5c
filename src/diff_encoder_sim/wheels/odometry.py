"""Wheel odometry: from two pulse counters to pose, twist and covariance."""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Deque, List, NamedTuple, Optional, Sequence, Tuple, TypeVar

import numpy as np

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, base_of_axle, move_along_arc
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.counter import PulseTotals
from diff_encoder_sim.wheels.covariance import (
    NO_ERRORS,
    PULSE_VARIANCE,
    LateralAcceleration,
    PlanarCovariance,
    Remainder,
    carry_geometry_errors,
    geometry_covariance,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
)
from diff_encoder_sim.wheels.encoder import STANDSTILL_AFTER_S
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS

log = logging.getLogger(__name__)

Number = TypeVar('Number', float, np.ndarray)
WheelRates = Tuple[float, float]  # left, right [rad/s]
RimMotion = Tuple[float, float]  # distance [m] and variance [m^2], or speed [m/s] and variance [m^2/s^2]


class TwistCovariance(NamedTuple):
    """A symmetric 2x2 covariance of (linear [m/s], angular [rad/s])."""

    linear: float = 0.0
    linear_angular: float = 0.0
    angular: float = 0.0


class TwistEstimator:
    """Computes the twist from counts or measured speeds, with an optional low-pass, whose delay is no variance."""

    def __init__(self, params: OdometryParams) -> None:
        self._params, self._m_per_pulse, self._travel_variance = params, params.m_per_pulse, params.travel_variance
        self._edge_variance, self._wave_variance = params.encoder.edge_variance, params.encoder.speed_variance
        self._low_pass_s, self._separation_m = params.velocity_low_pass, params.wheel_separation
        self._smooth: Optional[Sequence[RimMotion]] = None
        self._smooth_ns = 0

    def twist(
        self, totals: Sequence[Tuple[int, int, int]], measured_radps: Optional[WheelRates]
    ) -> Tuple[float, float, TwistCovariance]:
        """Return linear [m/s] and angular [rad/s] speed at the last reading; 0 for only one reading of counts.

        They are by the measured speeds of the left and the right wheel, or else the mean between the first and the last
        of `totals`: stamps, and left and right pulses since the start.
        """
        (first_ns, *first), (stamp_ns, *last) = totals[0], totals[-1]
        interval_s, separation_m = (stamp_ns - first_ns) / NANOSECONDS_PER_SECOND, self._separation_m
        if measured_radps is None:
            rims = []
            for new, old, m_per_pulse in zip(last, first, self._m_per_pulse):
                way_m = (new - old) * m_per_pulse
                # Two independent rounding errors.
                variance = 2.0 * reading_variance(m_per_pulse, self._edge_variance) + self._travel_variance * abs(way_m)
                rims.append((way_m, variance + self._wave_variance * way_m**2))
        else:
            interval_s, radii_m = 1.0, self._params.wheel_diameter.radii_m
            since_s = (stamp_ns - totals[-2][0]) / NANOSECONDS_PER_SECOND if len(totals) > 1 else 0.0
            rims = [
                self._speed(radps * radius_m, m_per_pulse, since_s)
                for radps, radius_m, m_per_pulse in zip(measured_radps, radii_m, self._m_per_pulse)
            ]
        if not interval_s:
            return 0.0, 0.0, TwistCovariance()
        if self._low_pass_s:
            speeds = [(way / interval_s, variance / interval_s**2) for way, variance in rims]
            rims, interval_s = self._smoothed(stamp_ns, speeds), 1.0
        (left, left_variance), (right, right_variance) = rims
        of_both = (left_variance + right_variance) / interval_s**2
        together = 0.5 * (right_variance - left_variance) / (separation_m * interval_s**2)
        covariance = TwistCovariance(0.25 * of_both, together, of_both / separation_m**2)
        return 0.5 * (left + right) / interval_s, (right - left) / (separation_m * interval_s), covariance

    def _speed(self, mps: float, m_per_pulse: float, interval_s: float) -> RimMotion:
        """Return a speed between two edges, with errors of their positions and of two clock readings."""
        if mps == 0.0:
            # It may creep by less than a count.
            return 0.0, PULSE_VARIANCE * (m_per_pulse / STANDSTILL_AFTER_S) ** 2
        least_s = interval_s if self._params.velocity_method == 'MT' else 0.0
        between_s = min(max(least_s, m_per_pulse / abs(mps)), STANDSTILL_AFTER_S)
        way_m2 = 2.0 * self._edge_variance * m_per_pulse**2 + self._travel_variance * abs(mps) * between_s
        time_s2 = (1.0 / self._params.velocity_clock) ** 2 / 6.0
        return mps, (way_m2 + mps**2 * time_s2) / between_s**2 + self._wave_variance * mps**2

    def _smoothed(self, stamp_ns: int, speeds: List[RimMotion]) -> List[RimMotion]:
        """Apply the low-pass, assuming independent errors of successive speeds."""
        if self._smooth is not None:
            passed_s = (stamp_ns - self._smooth_ns) / NANOSECONDS_PER_SECOND
            share = passed_s / (self._low_pass_s + passed_s)
            speeds = [
                (mean + share * (new - mean), (1.0 - share) ** 2 * variance + share**2 * of_new)
                for (mean, variance), (new, of_new) in zip(self._smooth, speeds)
            ]
        self._smooth, self._smooth_ns = speeds, stamp_ns
        return speeds


def wheel_speeds_mps(linear_mps: Number, angular_radps: Number, wheel_separation_m: float) -> Tuple[Number, Number]:
    """Return the left and right rim speeds of a twist, or of arrays of twists, at the axle's centre."""
    half_mps = 0.5 * wheel_separation_m * angular_radps
    return linear_mps - half_mps, linear_mps + half_mps


class OdometryEstimate(NamedTuple):
    """Pose and twist of wheel odometry at a stamp."""

    stamp_ns: int
    base_pose_in_odom: Pose2D  # yaw in [-pi, pi)
    linear_velocity_mps: float  # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    of_pose: PlanarCovariance = PlanarCovariance()  # in the odom frame
    of_twist: TwistCovariance = TwistCovariance()
    lateral_velocity_mps: float = 0.0  # along base_link's y; not 0 in turns if base_link is off the axle

    def twist_std(self) -> Tuple[float, float]:
        """Return the standard deviations of the twist, linear [m/s] and angular [rad/s]."""
        return math.sqrt(self.of_twist.linear), math.sqrt(self.of_twist.angular)


class WheelOdometry:
    """Dead reckoning from pulse counters; the first report is at pose zero."""

    def __init__(self, params: OdometryParams) -> None:
        self.params = params
        self.pulses, self._m_per_pulse = PulseTotals(params.counter_limits), params.m_per_pulse
        self._geometry_std, self._reading_m2 = params.geometry_std, params.reading_variances_m2
        self._noise, self._curve_noise = params.travel_variance, params.curve_noise or 0.0
        self._timeline = Timeline(LATE_REPORT_TOLERANCE_NS)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report with a new stamp is the start."""
        self.pulses.reset()
        # Of the readings that the twist spans: stamp, left and right pulses since the start.
        self._totals: Deque[Tuple[int, int, int]] = deque(maxlen=self.params.velocity_window + 1)
        self._twists, self._pull = TwistEstimator(self.params), LateralAcceleration(self.params.wheel_separation)
        self._pose = IDENTITY  # of the axle's centre, relative to its start
        self._remainders = Remainder(), Remainder()
        # Of second order: the variance of the travel by both roundings times that of the heading.
        second_m2 = (sum(self.params.reading_variances_m2) / self.params.wheel_separation) ** 2
        self._motion_covariance = PlanarCovariance(xx=second_m2, yy=second_m2)
        self._geometry_errors = NO_ERRORS

    def update(
        self, stamp_ns: int, left_count: int, right_count: int, wheel_rates_radps: Optional[WheelRates] = None
    ) -> Optional[OdometryEstimate]:
        """Process a report of the counters, and return the estimate; None if its stamp is stale.

        A stamp that jumps back resets odometry to pose zero. A count that jumps further than a wheel
        can turn restarts the counting and keeps the pose. Both log a warning.

        Args:
            stamp_ns: time of the reading [ns].
            left_count: the left counter, wrapped at `counter_modulus` or not.
            right_count: the right counter likewise.
            wheel_rates_radps: left and right wheel speeds measured by the controller, for the twist.
        """
        step = self._timeline.advance(stamp_ns)
        if step is Step.STALE:
            return None
        if step is Step.RESTART:
            stamp_s = stamp_ns / NANOSECONDS_PER_SECOND
            log.warning('encoder stamps went back to %.3f s: odometry restarted at pose zero', stamp_s, extra=EVENT)
            self.reset()
        totals = self.pulses.read(stamp_ns, left_count, right_count)
        if self._totals:
            self._integrate(self._totals[-1], totals)
        self._totals.append(totals)
        return self._estimate(stamp_ns, wheel_rates_radps)

    def _integrate(self, before: Tuple[int, int, int], after: Tuple[int, int, int]) -> None:
        """Move by the pulses between two stamps."""
        (left_m_per_pulse, right_m_per_pulse), separation_m = self._m_per_pulse, self.params.wheel_separation
        (before_ns, left_before, right_before), (after_ns, left_total, right_total) = before, after
        left, right = left_total - left_before, right_total - right_before
        left_m, right_m = left * left_m_per_pulse, right * right_m_per_pulse
        pull_mps2 = self._pull.take((after_ns - before_ns) / NANOSECONDS_PER_SECOND, left_m, right_m)
        mid_yaw_rad = self._pose.yaw_rad + 0.5 * (right_m - left_m) / separation_m
        across_x, across_y = -math.sin(mid_yaw_rad) / separation_m, math.cos(mid_yaw_rad) / separation_m
        of_left, of_right = self._remainders
        of_left.step(left, -across_x * right_m, -across_y * right_m)
        of_right.step(right, across_x * left_m, across_y * left_m)
        if not (left or right):
            return
        moved = move_along_arc(self._pose, 0.5 * (left_m + right_m), (right_m - left_m) / separation_m)
        motion = self._pose.yaw_rad, left_m, right_m, separation_m
        # The heading is computed from the totals: summed rounded increments would drift.
        yaw_rad = (right_total * right_m_per_pulse - left_total * left_m_per_pulse) / separation_m
        self._pose = Pose2D(moved.x_m, moved.y_m, yaw_rad)
        noise = self._noise + self._curve_noise * pull_mps2**2
        self._motion_covariance = propagate_motion_noise(self._motion_covariance, *motion, noise)
        self._geometry_errors = carry_geometry_errors(self._geometry_errors, *motion)

    def _estimate(self, stamp_ns: int, wheel_rates_radps: Optional[WheelRates]) -> OdometryEstimate:
        linear_mps, angular_radps, of_twist = self._twists.twist(self._totals, wheel_rates_radps)
        axle_x_m = self.params.axle_x
        separation_m = self.params.wheel_separation
        of_counts = quantisation_covariance(self._pose, self._reading_m2, separation_m, self._remainders)
        of_geometry = geometry_covariance(self._geometry_errors, self._geometry_std)
        covariance = self._motion_covariance.plus(of_counts).plus(of_geometry)
        if axle_x_m:
            sin_yaw, cos_yaw = math.sin(self._pose.yaw_rad), math.cos(self._pose.yaw_rad)
            covariance = covariance.carried_by_heading(axle_x_m * sin_yaw, -axle_x_m * cos_yaw)
        return OdometryEstimate(
            stamp_ns,
            base_of_axle(self._pose, axle_x_m),
            linear_mps,
            angular_radps,
            covariance,
            of_twist,
            0.0 - axle_x_m * angular_radps,  # never -0.0
        )
