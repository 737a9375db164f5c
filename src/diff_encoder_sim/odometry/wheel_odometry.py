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
from diff_encoder_sim.encoders.counter import CounterModulus, count_difference
from diff_encoder_sim.encoders.pulses import DEFAULT_PPR, PulsesPerRevolution
from diff_encoder_sim.odometry.mean_twist import MeanTwist, mean_twist
from diff_encoder_sim.odometry.odometry_covariance import behind_axle, propagate_motion_noise, quantisation_covariance

log = logging.getLogger(__name__)

# Reports come at 20 Hz or so; one that is further back than this belongs to a new run.
LATE_REPORT_TOLERANCE_NS = 100_000_000


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
    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')


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


class _Report(NamedTuple):
    stamp_ns: int
    left_pulses: int
    right_pulses: int


class WheelOdometry:
    """Dead reckoning from pulse counters, starting from pose zero at the first report."""

    def __init__(self, params: OdometryParams) -> None:
        self.params = params
        circumference_m = math.pi * params.wheel_diameter
        self._left_m_per_pulse = circumference_m / params.ppr.left
        self._right_m_per_pulse = circumference_m / params.ppr.right
        self._timeline = Timeline(LATE_REPORT_TOLERANCE_NS)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report of a new stamp, whatever it counts, is the start."""
        self._counters: Optional[_Report] = None
        self._totals: Deque[_Report] = deque(maxlen=self.params.velocity_window + 1)
        self._pose = IDENTITY  # of the axle's middle, where it began
        self._motion_covariance = np.zeros((3, 3))

    def update(self, stamp_ns: int, left_count: int, right_count: int) -> Optional[OdometryEstimate]:
        """Take one report of the counters, and return the estimate; None when its stamp is stale.

        A stamp that jumps back restarts from pose zero. A count that jumps further than a wheel
        can turn restarts the counting and keeps the pose. Either logs one warning.

        Args:
            stamp_ns: when the counters were read [ns].
            left_count: the left counter, wrapped at `counter_modulus` or not.
            right_count: the right counter likewise.
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
        return self._estimate(stamp_ns)

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
            self._move_pose(left_pulses * self._left_m_per_pulse, right_pulses * self._right_m_per_pulse)

    def _pulses_between(self, previous: _Report, report: _Report) -> Tuple[int, int]:
        """Return the left and right pulses between two reports; none where a counter was restarted."""
        modulus = self.params.counter_modulus
        left_pulses = count_difference(report.left_pulses, previous.left_pulses, modulus)
        right_pulses = count_difference(report.right_pulses, previous.right_pulses, modulus)
        interval_s = (report.stamp_ns - previous.stamp_ns) / NANOSECONDS_PER_SECOND
        if not self._is_implausible(left_pulses, right_pulses, interval_s):
            return left_pulses, right_pulses
        log.warning(
            '%d left and %d right pulses in %.3f s are faster than max_wheel_speed: '
            'taken as a counter restart, the pose is kept',
            left_pulses,
            right_pulses,
            interval_s,
            extra=EVENT,
        )
        return 0, 0

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
        return (
            total.right_pulses * self._right_m_per_pulse - total.left_pulses * self._left_m_per_pulse
        ) / self.params.wheel_separation

    def _is_implausible(self, left_pulses: int, right_pulses: int, interval_s: float) -> bool:
        ppr = self.params.ppr
        turns = max(abs(left_pulses) / ppr.left, abs(right_pulses) / ppr.right)
        return 2.0 * math.pi * turns > self.params.max_wheel_speed * interval_s

    def _estimate(self, stamp_ns: int) -> OdometryEstimate:
        twist = self._twist()
        pose_covariance = self._motion_covariance + quantisation_covariance(
            self._pose, self._left_m_per_pulse, self._right_m_per_pulse, self.params.wheel_separation
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

    def _twist(self) -> MeanTwist:
        """Return the mean twist over the window."""
        oldest, newest = self._totals[0], self._totals[-1]
        return mean_twist(
            (newest.left_pulses - oldest.left_pulses, newest.right_pulses - oldest.right_pulses),
            (self._left_m_per_pulse, self._right_m_per_pulse),
            (newest.stamp_ns - oldest.stamp_ns) / NANOSECONDS_PER_SECOND,
            self.params.wheel_separation,
            self.params.motion_noise,
        )
