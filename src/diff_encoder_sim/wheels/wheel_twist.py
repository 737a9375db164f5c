"""The twist of base_link by the motion of both wheels, and its covariance."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.counter_steps import Reading
from diff_encoder_sim.wheels.odometry_covariance import PULSE_VARIANCE, reading_variance
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_rate import STANDSTILL_AFTER_S

WheelRates = Tuple[float, float]  # left, right [rad/s]


class RimMotion(NamedTuple):
    """What a wheel's rim did: way [m] and its variance [m^2], or speed [m/s] and its variance [m^2/s^2]."""

    mean: float
    variance: float


Rims = Tuple[RimMotion, RimMotion]  # left, right


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
        self._smooth: Optional[Rims] = None
        self._smooth_ns = 0

    def twist(self, totals: Sequence[Reading], measured_radps: Optional[WheelRates]) -> WheelTwist:
        """Return the twist at the last of some readings; zero where there is but one, and no measured speed.

        Args:
            totals: pulses since the start; the mean by counts is between the first reading and the last.
            measured_radps: speeds of the wheels, left and right, which take the place of that mean.
        """
        separation_m, stamp_ns = self._params.wheel_separation, totals[-1].stamp_ns
        if measured_radps is not None:
            interval_s = _interval_s(totals[-2], totals[-1]) if len(totals) > 1 else 0.0
            speeds = self._measured_speeds(measured_radps, interval_s)
            return twist_of_rims(self._smoothed(stamp_ns, speeds), 1.0, separation_m)
        ways, interval_s = self._ways(totals[0], totals[-1]), _interval_s(totals[0], totals[-1])
        if not self._params.velocity_low_pass or interval_s == 0.0:
            return twist_of_rims(ways, interval_s, separation_m)
        left, right = (RimMotion(way / interval_s, variance / interval_s**2) for way, variance in ways)
        return twist_of_rims(self._smoothed(stamp_ns, (left, right)), 1.0, separation_m)

    def _ways(self, first: Reading, last: Reading) -> Rims:
        """Return the ways between two readings, whose rounding errors are independent."""
        left_m_per_pulse, right_m_per_pulse = self._m_per_pulse
        left = self._way(last.left_pulses - first.left_pulses, left_m_per_pulse)
        return left, self._way(last.right_pulses - first.right_pulses, right_m_per_pulse)

    def _way(self, pulses: int, m_per_pulse: float) -> RimMotion:
        way_m = pulses * m_per_pulse
        variance = 2.0 * reading_variance(m_per_pulse, self._edge_variance) + self._params.travel_variance * abs(way_m)
        return RimMotion(way_m, variance + self._wave_variance * way_m**2)

    def _measured_speeds(self, rates_radps: WheelRates, interval_s: float) -> Rims:
        left, right = (
            self._measured_speed(rate_radps * self._radius_m, m_per_pulse, interval_s)
            for rate_radps, m_per_pulse in zip(rates_radps, self._m_per_pulse)
        )
        return left, right

    def _measured_speed(self, mps: float, m_per_pulse: float, interval_s: float) -> RimMotion:
        """Return a speed between two edges: wrong by their places, and by two readings of the clock."""
        if mps == 0.0:
            # It may creep, by less than a count until that is noticed.
            return RimMotion(0.0, PULSE_VARIANCE * (m_per_pulse / STANDSTILL_AFTER_S) ** 2)
        least_s = interval_s if self._params.velocity_method == 'MT' else 0.0
        between_s = min(max(least_s, m_per_pulse / abs(mps)), STANDSTILL_AFTER_S)
        way_m2 = 2.0 * self._edge_variance * m_per_pulse**2 + self._params.travel_variance * abs(mps) * between_s
        time_s2 = self._tick_s**2 / 6.0
        return RimMotion(mps, (way_m2 + mps**2 * time_s2) / between_s**2 + self._wave_variance * mps**2)

    def _smoothed(self, stamp_ns: int, speeds: Rims) -> Rims:
        """Pass the speeds through the low-pass; errors of one and the next are taken as independent."""
        if self._smooth is not None and self._params.velocity_low_pass:
            passed_s = (stamp_ns - self._smooth_ns) / NANOSECONDS_PER_SECOND
            share = passed_s / (self._params.velocity_low_pass + passed_s)
            left, right = (_mixed(old, new, share) for old, new in zip(self._smooth, speeds))
            speeds = left, right
        self._smooth, self._smooth_ns = speeds, stamp_ns
        return speeds


def twist_of_rims(rims: Rims, interval_s: float, wheel_separation_m: float) -> WheelTwist:
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


def _mixed(old: RimMotion, new: RimMotion, share: float) -> RimMotion:
    return RimMotion(
        old.mean + share * (new.mean - old.mean), (1.0 - share) ** 2 * old.variance + share**2 * new.variance
    )


def _interval_s(first: Reading, last: Reading) -> float:
    return (last.stamp_ns - first.stamp_ns) / NANOSECONDS_PER_SECOND
