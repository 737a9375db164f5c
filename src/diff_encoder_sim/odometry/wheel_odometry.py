"""Wheel odometry: from two pulse counters to pose, twist and covariance.

Pulses are accumulated as whole numbers and only then turned into metres, so the heading is a
function of the totals and never random-walks, and an equal motion gives an equal pose however it
is split into samples.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between, Length_m, Offset_m, TravelVariance_m
from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.encoders.counter import CounterModulus, count_difference, wrap_count
from diff_encoder_sim.encoders.encoder_model import IDEAL_ENCODER, EncoderModel, counts_per_turn
from diff_encoder_sim.encoders.pulses import DEFAULT_PPR, PerWheel, PulsesPerRevolution
from diff_encoder_sim.encoders.wheel_rate import VelocityMethod
from diff_encoder_sim.odometry.counter_restart import is_restart
from diff_encoder_sim.odometry.mean_twist import MeanTwist, mean_twist, wheel_speeds_mps
from diff_encoder_sim.odometry.odometry_covariance import (
    behind_axle,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
    residual_std,
)

log = logging.getLogger(__name__)

# A report that others have overtaken is ignored; one that is further back than this belongs to a new run. At 5 Hz one
# that comes after the next is 0.2 s back.
LATE_REPORT_TOLERANCE_NS = 500_000_000


class OdometryParams(Params):
    """Parameters of gz_diff_odom_node, under the names that users set.

    `wheel_diameter` and `wheel_separation` are the geometry that odometry assumes; the true one
    is the simulator's.
    """

    ppr: PulsesPerRevolution = DEFAULT_PPR
    wheel_diameter: Length_m = Field(0.2, description='as the odometry assumes it [m]')
    wheel_separation: Length_m = Field(0.4, description='between the contact points, as the odometry assumes it [m]')
    axle_x: Offset_m = Field(0.0, description='place of the axle ahead of the origin of base_frame [m]')
    counter_modulus: CounterModulus = 0
    velocity_window: Annotated[int, Between(1, 10_000)] = Field(1, description='report intervals that the twist spans')
    motion_noise: TravelVariance_m = Field(1e-6, description="variance of a wheel's travel per metre of it [m^2/m]")
    max_wheel_speed: Annotated[float, Between(1e-3, 1e9, 'rad/s')] = Field(
        100.0, description='a faster wheel means that the counter was restarted [rad/s]'
    )
    max_wheel_acceleration: Annotated[float, Between(1e-1, 1e9, 'rad/s^2')] = Field(
        200.0, description='counters near zero that this cannot explain were restarted, too [rad/s^2]'
    )
    encoder: EncoderModel = IDEAL_ENCODER
    velocity_method: VelocityMethod = 'M'
    velocity_low_pass: Annotated[float, Between(0.0, 100.0, 's')] = Field(
        0.0, description="time constant of a low-pass on the wheels' speeds in the twist [s]; 0: none"
    )
    following_error_window: Annotated[float, Between(1e-3, 1e9, 'rad/s')] = Field(
        1.0, description='on /diagnostics: how far a wheel may be from its commanded speed [rad/s]'
    )
    following_error_timeout: Annotated[float, Between(1e-2, 1e6, 's')] = Field(
        1.0, description='on /diagnostics: for how long it may be further from it [s]'
    )
    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')

    @property
    def counts_per_turn(self) -> PerWheel:
        """Return the counts per wheel revolution: the encoder's, where it says them, else `ppr`."""
        return counts_per_turn(self.ppr, self.encoder)


class OdometryEstimate(NamedTuple):
    """Pose and twist by the wheels at one instant."""

    stamp_ns: int
    base_pose_in_odom: Pose2D  # yaw in [-pi, pi)
    linear_velocity_mps: float  # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    pose_covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]) in the odom frame
    twist_covariance: np.ndarray  # 2x2 over (linear [m/s], angular [rad/s])
    lateral_velocity_mps: float = 0.0  # along base_link's y: where base_link is not on the axle, it swings in turns

    def twist_std(self) -> Tuple[float, float]:
        """Return the standard deviations of the twist, linear [m/s] and angular [rad/s]."""
        return (math.sqrt(self.twist_covariance[0, 0]), math.sqrt(self.twist_covariance[1, 1]))


WheelRates = Tuple[float, float]  # left, right [rad/s]


class _Report(NamedTuple):
    stamp_ns: int
    left_pulses: int
    right_pulses: int


class WheelOdometry:
    """Dead reckoning from pulse counters, starting from pose zero at the first report."""

    def __init__(self, params: OdometryParams) -> None:
        self.params = params
        circumference_m = math.pi * params.wheel_diameter
        self._ppr = params.counts_per_turn
        self._m_per_pulse = circumference_m / self._ppr.left, circumference_m / self._ppr.right
        self._reading_vars_m2 = self._reading_variances(params)
        self._residual_m = residual_std(*self._m_per_pulse)
        self._timeline = Timeline(LATE_REPORT_TOLERANCE_NS)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report of a new stamp, whatever it counts, is the start."""
        self._counters: Optional[_Report] = None
        self._totals: Deque[_Report] = deque(maxlen=self.params.velocity_window + 1)
        self._pose = IDENTITY  # of the axle's middle, where it began
        self._motion_covariance = np.zeros((3, 3))
        self._rates: Optional[WheelRates] = None  # after the low-pass
        self._rates_ns = 0
        self.restarts = 0  # of counters

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
        self._integrate(_Report(stamp_ns, left_count, right_count))
        return self._estimate(stamp_ns, wheel_rates_radps)

    def _integrate(self, report: _Report) -> None:
        if self._counters is None:
            self._totals.append(_Report(report.stamp_ns, 0, 0))
        else:
            self._move(report, self._counters)
        self._counters = report

    def _move(self, report: _Report, previous: _Report) -> None:
        left_pulses, right_pulses = self._pulses_between(previous, report)
        total = self._totals[-1]
        self._totals.append(
            _Report(report.stamp_ns, total.left_pulses + left_pulses, total.right_pulses + right_pulses)
        )
        if left_pulses or right_pulses:
            left_m_per_pulse, right_m_per_pulse = self._m_per_pulse
            self._move_pose(left_pulses * left_m_per_pulse, right_pulses * right_m_per_pulse)

    def _pulses_between(self, previous: _Report, report: _Report) -> Tuple[int, int]:
        """Return the left and right pulses between two reports; none where a counter was restarted."""
        modulus = self.params.counter_modulus
        left_pulses = count_difference(report.left_pulses, previous.left_pulses, modulus)
        right_pulses = count_difference(report.right_pulses, previous.right_pulses, modulus)
        pulses, counts = (left_pulses, right_pulses), _signed(report, modulus)
        interval_s = (report.stamp_ns - previous.stamp_ns) / NANOSECONDS_PER_SECOND
        is_near_zero = self._is_restart(_signed(previous, modulus), counts, pulses, interval_s)
        if not is_near_zero and not self._is_implausible(left_pulses, right_pulses, interval_s):
            return pulses
        self.restarts += 1
        log.warning(
            '%d left and %d right pulses in %.3f s are faster than %s: taken as a counter restart, the pose is kept',
            left_pulses,
            right_pulses,
            interval_s,
            'max_wheel_acceleration allows' if is_near_zero else 'max_wheel_speed',
            extra=EVENT,
        )
        return counts if is_near_zero else (0, 0)

    def _is_restart(
        self, counts_before: Tuple[int, int], counts: Tuple[int, int], pulses: Tuple[int, int], interval_s: float
    ) -> bool:
        """Return whether the counters began anew at zero."""
        if len(self._totals) < 2:
            return False
        before, last = self._totals[-2], self._totals[-1]
        share = interval_s * NANOSECONDS_PER_SECOND / (last.stamp_ns - before.stamp_ns)
        went = (last.left_pulses - before.left_pulses) * share, (last.right_pulses - before.right_pulses) * share
        turns = self.params.max_wheel_acceleration * interval_s**2 / (2.0 * math.pi)
        return is_restart(counts_before, counts, pulses, went, (turns * self._ppr.left, turns * self._ppr.right))

    def _move_pose(self, left_m: float, right_m: float) -> None:
        start = self._pose
        moved = move_along_arc(start, 0.5 * (left_m + right_m), (right_m - left_m) / self.params.wheel_separation)
        # The heading comes from the totals: adding up rounded increments would let it drift.
        self._pose = moved._replace(yaw_rad=self._heading_rad(self._totals[-1]))
        self._motion_covariance = propagate_motion_noise(
            self._motion_covariance,
            start.yaw_rad,
            left_m,
            right_m,
            self.params.wheel_separation,
            self.params.motion_noise,
        )

    def _heading_rad(self, total: _Report) -> float:
        left_m_per_pulse, right_m_per_pulse = self._m_per_pulse
        travel_m = total.right_pulses * right_m_per_pulse - total.left_pulses * left_m_per_pulse
        return travel_m / self.params.wheel_separation

    def _is_implausible(self, left_pulses: int, right_pulses: int, interval_s: float) -> bool:
        ppr = self._ppr
        turns = max(abs(left_pulses) / ppr.left, abs(right_pulses) / ppr.right)
        return 2.0 * math.pi * turns > self.params.max_wheel_speed * interval_s

    def _estimate(self, stamp_ns: int, wheel_rates_radps: Optional[WheelRates]) -> OdometryEstimate:
        twist = self._twist(stamp_ns, wheel_rates_radps)
        pose_covariance = self._motion_covariance + quantisation_covariance(
            self._pose, *self._reading_vars_m2, self._residual_m, self.params.wheel_separation
        )
        axle_x_m = self.params.axle_x
        if axle_x_m:
            pose_covariance = behind_axle(pose_covariance, self._pose.yaw_rad, axle_x_m)
        return OdometryEstimate(
            stamp_ns,
            self._base_pose(),
            twist.linear_mps,
            twist.angular_radps,
            pose_covariance,
            twist.covariance,
            0.0 - axle_x_m * twist.angular_radps,  # never -0.0
        )

    def _base_pose(self) -> Pose2D:
        """Return the pose of base_frame: the axle's, moved back along its x on the way there and at its end."""
        axle, axle_x_m = IDENTITY.compose(self._pose), self.params.axle_x
        return axle._replace(
            x_m=axle.x_m + axle_x_m * (1.0 - math.cos(axle.yaw_rad)), y_m=axle.y_m - axle_x_m * math.sin(axle.yaw_rad)
        )

    def _twist(self, stamp_ns: int, measured_radps: Optional[WheelRates]) -> MeanTwist:
        """Return the mean twist over the window; by the measured speeds, where there are any, with its covariance."""
        oldest, newest = self._totals[0], self._totals[-1]
        pulses = newest.left_pulses - oldest.left_pulses, newest.right_pulses - oldest.right_pulses
        interval_s = (newest.stamp_ns - oldest.stamp_ns) / NANOSECONDS_PER_SECOND
        separation_m = self.params.wheel_separation
        twist = mean_twist(
            pulses, self._m_per_pulse, self._reading_vars_m2, interval_s, separation_m, self.params.motion_noise
        )
        if measured_radps is None and not self.params.velocity_low_pass:
            return twist
        radius_m = 0.5 * self.params.wheel_diameter
        if measured_radps is None:
            left_mps, right_mps = wheel_speeds_mps(twist.linear_mps, twist.angular_radps, separation_m)
            measured_radps = left_mps / radius_m, right_mps / radius_m
        left_mps, right_mps = (
            0.5 * self.params.wheel_diameter * rate for rate in self._smoothed(stamp_ns, measured_radps)
        )
        return twist._replace(
            linear_mps=0.5 * (left_mps + right_mps), angular_radps=(right_mps - left_mps) / separation_m
        )

    def _smoothed(self, stamp_ns: int, rates_radps: WheelRates) -> WheelRates:
        """Pass the wheels' speeds through the low-pass."""
        if self._rates is not None and self.params.velocity_low_pass:
            passed_s = (stamp_ns - self._rates_ns) / NANOSECONDS_PER_SECOND
            share = passed_s / (self.params.velocity_low_pass + passed_s)
            left, right = (old + share * (new - old) for old, new in zip(self._rates, rates_radps))
            rates_radps = left, right
        self._rates, self._rates_ns = rates_radps, stamp_ns
        return rates_radps

    def _reading_variances(self, params: OdometryParams) -> Tuple[float, float]:
        """Return the variance of each wheel's travel in one reading [m^2]."""
        left, right = (
            reading_variance(m_per_pulse, params.encoder.pulse_variance(counts))
            for m_per_pulse, counts in zip(self._m_per_pulse, (self._ppr.left, self._ppr.right))
        )
        return left, right


def _signed(report: _Report, modulus: int) -> Tuple[int, int]:
    """Return the counters as those that count down from zero to below it."""
    return wrap_count(report.left_pulses, modulus), wrap_count(report.right_pulses, modulus)
