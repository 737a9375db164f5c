"""Wheel odometry: from two pulse counters to pose, twist and covariance."""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, base_of_axle, move_along_arc
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.counter import CounterSteps, Reading
from diff_encoder_sim.wheels.covariance import (
    KNOWN_EXACTLY,
    NO_ERRORS,
    PULSE_VARIANCE,
    LateralAcceleration,
    PlanarCovariance,
    behind_axle,
    carry_geometry_errors,
    geometry_covariance,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
    residual_std,
)
from diff_encoder_sim.wheels.encoder import STANDSTILL_AFTER_S
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS

log = logging.getLogger(__name__)

WheelRates = Tuple[float, float]  # left, right [rad/s]


class TwistCovariance(NamedTuple):
    """A symmetric 2x2 covariance of (linear [m/s], angular [rad/s])."""

    linear: float = 0.0
    linear_angular: float = 0.0
    angular: float = 0.0

    def matrix(self) -> np.ndarray:
        """Return it as 2x2."""
        return np.array([[self.linear, self.linear_angular], [self.linear_angular, self.angular]])


class WheelTwist(NamedTuple):
    """A twist over some interval, in base_link."""

    linear_mps: float  # along x, signed
    angular_radps: float  # counter-clockwise
    covariance: TwistCovariance


class RimMotion(NamedTuple):
    """Motion of a wheel's rim: distance [m] and variance [m^2], or speed [m/s] and variance [m^2/s^2]."""

    mean: float
    variance: float


class TwistEstimator:
    """Computes the twist from counts or measured speeds, with an optional low-pass.

    The covariance does not include the delay of the low-pass.
    """

    def __init__(self, params: OdometryParams) -> None:
        self._params, self._radius_m = params, 0.5 * params.wheel_diameter
        self._m_per_pulse = params.m_per_pulse
        self._edge_variance, self._wave_variance = params.encoder.edge_variance, params.encoder.speed_variance
        self._tick_s = 1.0 / params.velocity_clock
        self.reset()

    def reset(self) -> None:
        """Clear the low-pass."""
        self._smooth: Optional[Sequence[RimMotion]] = None
        self._smooth_ns = 0

    def twist(self, totals: Sequence[Reading], measured_radps: Optional[WheelRates]) -> WheelTwist:
        """Return the twist at the last reading; zero for a single reading without measured speeds.

        Args:
            totals: pulses since the start; the twist is the mean between the first and the last reading.
            measured_radps: left and right wheel speeds, used instead of that mean.
        """
        separation_m, (stamp_ns, *last) = self._params.wheel_separation, totals[-1]
        first_ns, *first = totals[0]
        interval_s = (stamp_ns - first_ns) / NANOSECONDS_PER_SECOND
        if measured_radps is not None:
            since_s = (stamp_ns - totals[-2].stamp_ns) / NANOSECONDS_PER_SECOND if len(totals) > 1 else 0.0
            speeds = [
                self._measured(radps * self._radius_m, m_per_pulse, since_s)
                for radps, m_per_pulse in zip(measured_radps, self._m_per_pulse)
            ]
            return twist_of_rims(self._smoothed(stamp_ns, speeds), 1.0, separation_m)
        ways = [
            self._way((new - old) * m_per_pulse, m_per_pulse)
            for new, old, m_per_pulse in zip(last, first, self._m_per_pulse)
        ]
        if not self._params.velocity_low_pass or interval_s == 0.0:
            return twist_of_rims(ways, interval_s, separation_m)
        speeds = [RimMotion(way / interval_s, variance / interval_s**2) for way, variance in ways]
        return twist_of_rims(self._smoothed(stamp_ns, speeds), 1.0, separation_m)

    def _way(self, way_m: float, m_per_pulse: float) -> RimMotion:
        """Return the distance between two readings, with independent rounding errors."""
        variance = 2.0 * reading_variance(m_per_pulse, self._edge_variance) + self._params.travel_variance * abs(way_m)
        return RimMotion(way_m, variance + self._wave_variance * way_m**2)

    def _measured(self, mps: float, m_per_pulse: float, interval_s: float) -> RimMotion:
        """Return a speed between two edges, with errors of their positions and of two clock readings."""
        if mps == 0.0:
            # It may creep by less than a count.
            return RimMotion(0.0, PULSE_VARIANCE * (m_per_pulse / STANDSTILL_AFTER_S) ** 2)
        least_s = interval_s if self._params.velocity_method == 'MT' else 0.0
        between_s = min(max(least_s, m_per_pulse / abs(mps)), STANDSTILL_AFTER_S)
        way_m2 = 2.0 * self._edge_variance * m_per_pulse**2 + self._params.travel_variance * abs(mps) * between_s
        time_s2 = self._tick_s**2 / 6.0
        return RimMotion(mps, (way_m2 + mps**2 * time_s2) / between_s**2 + self._wave_variance * mps**2)

    def _smoothed(self, stamp_ns: int, speeds: Sequence[RimMotion]) -> Sequence[RimMotion]:
        """Apply the low-pass, assuming independent errors of successive speeds."""
        if self._smooth is not None and self._params.velocity_low_pass:
            passed_s = (stamp_ns - self._smooth_ns) / NANOSECONDS_PER_SECOND
            share = passed_s / (self._params.velocity_low_pass + passed_s)
            speeds = [
                RimMotion(
                    old.mean + share * (new.mean - old.mean),
                    (1.0 - share) ** 2 * old.variance + share**2 * new.variance,
                )
                for old, new in zip(self._smooth, speeds)
            ]
        self._smooth, self._smooth_ns = speeds, stamp_ns
        return speeds


def twist_of_rims(rims: Sequence[RimMotion], interval_s: float, wheel_separation_m: float) -> WheelTwist:
    """Return the twist of both rims' motion in an interval; zero if the interval is 0.

    Args:
        rims: left and right distances; or speeds, with an interval of 1 s.
        interval_s: duration of the motion.
        wheel_separation_m: between the contact points.
    """
    if interval_s == 0.0:
        return WheelTwist(0.0, 0.0, TwistCovariance())
    (left, left_variance), (right, right_variance) = rims
    of_both = (left_variance + right_variance) / interval_s**2
    together = 0.5 * (right_variance - left_variance) / (wheel_separation_m * interval_s**2)
    covariance = TwistCovariance(0.25 * of_both, together, of_both / wheel_separation_m**2)
    return WheelTwist(0.5 * (left + right) / interval_s, (right - left) / (wheel_separation_m * interval_s), covariance)


def wheel_speeds_mps(linear_mps: float, angular_radps: float, wheel_separation_m: float) -> Tuple[float, float]:
    """Return the left and right rim speeds of a twist at the axle's centre."""
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

    @property
    def pose_covariance(self) -> np.ndarray:
        """Return the 3x3 covariance over (x [m], y [m], yaw [rad]) in the odom frame."""
        return self.of_pose.matrix()

    @property
    def twist_covariance(self) -> np.ndarray:
        """Return the 2x2 covariance over (linear [m/s], angular [rad/s])."""
        return self.of_twist.matrix()

    def twist_std(self) -> Tuple[float, float]:
        """Return the standard deviations of the twist, linear [m/s] and angular [rad/s]."""
        return math.sqrt(self.of_twist.linear), math.sqrt(self.of_twist.angular)


class WheelOdometry:
    """Dead reckoning from pulse counters; the first report is at pose zero."""

    def __init__(self, params: OdometryParams) -> None:
        self.params = params
        self._m_per_pulse = params.m_per_pulse
        self._reading_vars_m2 = params.reading_variances_m2
        self._heading_var_rad2 = sum(self._reading_vars_m2) / params.wheel_separation**2
        self._residual_m = residual_std(*self._m_per_pulse)
        self._geometry_std = params.geometry_std
        self._timeline = Timeline(LATE_REPORT_TOLERANCE_NS)
        self._steps, self._twists = CounterSteps(params.counter_limits), TwistEstimator(params)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report with a new stamp is the start."""
        self._steps.reset()
        self._twists.reset()
        self._pull = LateralAcceleration(self.params.wheel_separation)
        self._totals: Deque[Reading] = deque(maxlen=self.params.velocity_window + 1)
        self._pose = IDENTITY  # of the axle's centre, relative to its start
        self._motion_covariance = PlanarCovariance()
        self._geometry_errors = NO_ERRORS

    @property
    def restarts(self) -> int:
        """Return the number of counter restarts."""
        return self._steps.restarts

    @property
    def counts(self) -> Tuple[int, int]:
        """Return the left and right pulses since the start, across wraps and restarts of the counters."""
        return (self._totals[-1].left_pulses, self._totals[-1].right_pulses) if self._totals else (0, 0)

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
            log.warning(
                'encoder stamps went back to %.3f s: odometry restarted at pose zero',
                stamp_ns / NANOSECONDS_PER_SECOND,
                extra=EVENT,
            )
            self.reset()
        self._integrate(Reading(stamp_ns, left_count, right_count))
        return self._estimate(stamp_ns, wheel_rates_radps)

    def _integrate(self, reading: Reading) -> None:
        step = self._steps.take(reading)
        if step is None:
            self._totals.append(Reading(reading.stamp_ns, 0, 0))
            return
        if step.restart:
            log.warning('%s: taken as a counter restart, the pose is kept', step.restart, extra=EVENT)
        last, separation_m = self._totals[-1], self.params.wheel_separation
        left_total, right_total = last.left_pulses + step.left_pulses, last.right_pulses + step.right_pulses
        self._totals.append(Reading(reading.stamp_ns, left_total, right_total))
        left_m_per_pulse, right_m_per_pulse = self._m_per_pulse
        left_m, right_m = step.left_pulses * left_m_per_pulse, step.right_pulses * right_m_per_pulse
        pull_mps2 = self._pull.take((reading.stamp_ns - last.stamp_ns) / NANOSECONDS_PER_SECOND, left_m, right_m)
        if not (step.left_pulses or step.right_pulses):
            return
        moved = move_along_arc(self._pose, 0.5 * (left_m + right_m), (right_m - left_m) / separation_m)
        motion = self._pose.yaw_rad, left_m, right_m, separation_m
        # The heading is computed from the totals: summed rounded increments would drift.
        yaw_rad = (right_total * right_m_per_pulse - left_total * left_m_per_pulse) / separation_m
        self._pose = Pose2D(moved.x_m, moved.y_m, yaw_rad)
        noise = self.params.travel_variance + (self.params.curve_noise or 0.0) * pull_mps2**2
        self._motion_covariance = propagate_motion_noise(
            self._motion_covariance, *motion, noise, self._heading_var_rad2
        )
        if self._geometry_std != KNOWN_EXACTLY:
            self._geometry_errors = carry_geometry_errors(self._geometry_errors, self._geometry_std, *motion)

    def _estimate(self, stamp_ns: int, wheel_rates_radps: Optional[WheelRates]) -> OdometryEstimate:
        twist, axle_x_m = self._twists.twist(self._totals, wheel_rates_radps), self.params.axle_x
        separation_m = self.params.wheel_separation
        covariance = self._motion_covariance.plus(
            quantisation_covariance(self._pose, *self._reading_vars_m2, self._residual_m, separation_m)
        )
        if self._geometry_std != KNOWN_EXACTLY:
            covariance = covariance.plus(geometry_covariance(self._geometry_errors, self._geometry_std))
        if axle_x_m:
            covariance = behind_axle(covariance, self._pose.yaw_rad, axle_x_m)
        return OdometryEstimate(
            stamp_ns,
            base_of_axle(self._pose, axle_x_m),
            twist.linear_mps,
            twist.angular_radps,
            covariance,
            twist.covariance,
            0.0 - axle_x_m * twist.angular_radps,  # never -0.0
        )
