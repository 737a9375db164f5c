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
    """What a wheel's rim did: way [m] and its variance [m^2], or speed [m/s] and its variance [m^2/s^2]."""

    mean: float
    variance: float


class TwistEstimator:
    """Computes the twist: the mean one by counts, or that of measured speeds; with or without a low-pass.

    The covariance is that of the speeds that were measured: it does not know how late a low-pass is.
    """

    def __init__(self, params: OdometryParams) -> None:
        self._params, self._radius_m = params, 0.5 * params.wheel_diameter
        self._m_per_pulse = params.m_per_pulse
        self._edge_variance, self._wave_variance = params.encoder.edge_variance, params.encoder.speed_variance
        self._tick_s = 1.0 / params.velocity_clock
        self.reset()

    def reset(self) -> None:
        """Forget the speeds before."""
        self._smooth: Optional[Sequence[RimMotion]] = None
        self._smooth_ns = 0

    def twist(self, totals: Sequence[Reading], measured_radps: Optional[WheelRates]) -> WheelTwist:
        """Return the twist at the last of some readings; zero if there is only one, and no measured speed.

        Args:
            totals: pulses since the start; the mean by counts is between the first reading and the last.
            measured_radps: speeds of the wheels, left and right, which take the place of that mean.
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
        """Return the way between two readings, whose rounding errors are independent."""
        variance = 2.0 * reading_variance(m_per_pulse, self._edge_variance) + self._params.travel_variance * abs(way_m)
        return RimMotion(way_m, variance + self._wave_variance * way_m**2)

    def _measured(self, mps: float, m_per_pulse: float, interval_s: float) -> RimMotion:
        """Return a speed between two edges: wrong by their places, and by two readings of the clock."""
        if mps == 0.0:
            # It may creep, by less than a count until that is noticed.
            return RimMotion(0.0, PULSE_VARIANCE * (m_per_pulse / STANDSTILL_AFTER_S) ** 2)
        least_s = interval_s if self._params.velocity_method == 'MT' else 0.0
        between_s = min(max(least_s, m_per_pulse / abs(mps)), STANDSTILL_AFTER_S)
        way_m2 = 2.0 * self._edge_variance * m_per_pulse**2 + self._params.travel_variance * abs(mps) * between_s
        time_s2 = self._tick_s**2 / 6.0
        return RimMotion(mps, (way_m2 + mps**2 * time_s2) / between_s**2 + self._wave_variance * mps**2)

    def _smoothed(self, stamp_ns: int, speeds: Sequence[RimMotion]) -> Sequence[RimMotion]:
        """Pass the speeds through the low-pass; errors of one and the next are taken as independent."""
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
    """Return the twist that moves the rims of both wheels by their ways within an interval; zero over no time.

    Args:
        rims: ways of the left and the right wheel; or speeds, and an interval of 1 s.
        interval_s: of the ways.
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
    """Return the speeds of the left and right rim in a twist of base_link, the axle's middle."""
    half_mps = 0.5 * wheel_separation_m * angular_radps
    return linear_mps - half_mps, linear_mps + half_mps


class OdometryEstimate(NamedTuple):
    """Pose and twist by the wheels at one instant."""

    stamp_ns: int
    base_pose_in_odom: Pose2D  # yaw in [-pi, pi)
    linear_velocity_mps: float  # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    of_pose: PlanarCovariance = PlanarCovariance()  # in the odom frame
    of_twist: TwistCovariance = TwistCovariance()
    lateral_velocity_mps: float = 0.0  # along base_link's y: if base_link is not on the axle, it swings in turns

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
    """Dead reckoning from pulse counters, starting from pose zero at the first report."""

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
        """Return to pose zero; the next report of a new stamp, whatever it counts, is the start."""
        self._steps.reset()
        self._twists.reset()
        self._pull = LateralAcceleration(self.params.wheel_separation)
        self._totals: Deque[Reading] = deque(maxlen=self.params.velocity_window + 1)
        self._pose = IDENTITY  # of the axle's middle, where it began
        self._motion_covariance = PlanarCovariance()
        self._geometry_errors = NO_ERRORS

    @property
    def restarts(self) -> int:
        """Return how often the counters were restarted."""
        return self._steps.restarts

    @property
    def counts(self) -> Tuple[int, int]:
        """Return the left and right pulses since the start, across wraps and restarts of the counters."""
        return (self._totals[-1].left_pulses, self._totals[-1].right_pulses) if self._totals else (0, 0)

    def update(
        self, stamp_ns: int, left_count: int, right_count: int, wheel_rates_radps: Optional[WheelRates] = None
    ) -> Optional[OdometryEstimate]:
        """Take one report of the counters, and return the estimate; None when its stamp is stale.

        A stamp that jumps back restarts from pose zero. A count that jumps further than a wheel
        can turn restarts the counting and keeps the pose. Either logs one warning.

        Args:
            stamp_ns: when the counters were read [ns].
            left_count: the left counter, wrapped at `counter_modulus` or not.
            right_count: the right counter likewise.
            wheel_rates_radps: the wheels' speeds, left and right, as the controller measures them: of the twist.
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
        # The heading comes from the totals: adding up rounded increments would let it drift.
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
