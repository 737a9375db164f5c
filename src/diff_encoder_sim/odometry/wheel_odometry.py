"""Wheel odometry: from two pulse counters to pose, twist and covariance.

Pulses are accumulated as whole numbers and only then turned into metres, so the heading is a
function of the totals and never random-walks, and an equal motion gives an equal pose however it
is split into samples.
"""

from __future__ import annotations

import functools
import logging
import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

import numpy as np
from pydantic import Field

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.encoders.counter import CounterModulus, count_difference
from diff_encoder_sim.encoders.pulses import DEFAULT_PPR, PulsesPerRevolution
from diff_encoder_sim.odometry.odometry_covariance import (
    PULSE_VARIANCE,
    propagate_motion_noise,
    quantisation_covariance,
)

log = logging.getLogger(__name__)

# Reports come at 20 Hz or so; one that is further back than this belongs to a new run.
LATE_REPORT_TOLERANCE_NS = 100_000_000


class OdometryParams(Params):
    """Parameters of gz_diff_odom_node, under the names that users set.

    `wheel_diameter` and `wheel_separation` are what the robot believes of itself; the true
    geometry is the simulator's.
    """

    ppr: PulsesPerRevolution = DEFAULT_PPR
    wheel_diameter: float = Field(0.2, gt=0, description='as the odometry assumes it [m]')
    wheel_separation: float = Field(0.4, gt=0, description='between the contact points, as the odometry assumes it [m]')
    counter_modulus: CounterModulus = 0
    velocity_window: int = Field(1, ge=1, description='report intervals that the twist spans')
    motion_noise: float = Field(1e-6, ge=0, description="variance of a wheel's travel per metre of it [m^2/m]")
    max_wheel_speed: float = Field(
        100.0, gt=0, description='a faster wheel means that the counter was restarted [rad/s]'
    )
    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')


class OdometryEstimate(NamedTuple):
    """What the wheels tell at one instant."""

    stamp_ns: int
    base_pose_in_odom: Pose2D  # yaw in [-pi, pi)
    linear_velocity_mps: float  # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    pose_covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]) in the odom frame
    twist_covariance: np.ndarray  # 2x2 over (linear [m/s], angular [rad/s])

    def twist_std(self) -> Tuple[float, float]:
        """Standard deviations of the twist, linear [m/s] and angular [rad/s]."""
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
        """Back to pose zero; the next report of a new stamp, whatever it counts, is the start."""
        self._counters: Optional[_Report] = None
        self._totals: Deque[_Report] = deque(maxlen=self.params.velocity_window + 1)
        self._pose = IDENTITY
        self._motion_covariance = np.zeros((3, 3))

    def update(self, stamp_ns: int, left_count: int, right_count: int) -> Optional[OdometryEstimate]:
        """Take one report of the counters; None when its stamp is stale.

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
        modulus = self.params.counter_modulus
        left_pulses = count_difference(report.left_pulses, previous.left_pulses, modulus)
        right_pulses = count_difference(report.right_pulses, previous.right_pulses, modulus)
        interval_s = (report.stamp_ns - previous.stamp_ns) / NANOSECONDS_PER_SECOND
        if self._is_implausible(left_pulses, right_pulses, interval_s):
            log.warning(
                '%d left and %d right pulses in %.3f s are faster than max_wheel_speed: '
                'taken as a counter restart, the pose is kept',
                left_pulses,
                right_pulses,
                interval_s,
                extra=EVENT,
            )
            left_pulses = right_pulses = 0
        total = self._totals[-1]
        self._totals.append(
            _Report(report.stamp_ns, total.left_pulses + left_pulses, total.right_pulses + right_pulses)
        )
        if left_pulses or right_pulses:
            self._move_pose(left_pulses * self._left_m_per_pulse, right_pulses * self._right_m_per_pulse)

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
        linear_mps, angular_radps, twist_covariance = self._twist()
        pose_covariance = self._motion_covariance + quantisation_covariance(
            self._pose, self._left_m_per_pulse, self._right_m_per_pulse, self.params.wheel_separation
        )
        wrapped_pose = IDENTITY.compose(self._pose)
        return OdometryEstimate(stamp_ns, wrapped_pose, linear_mps, angular_radps, pose_covariance, twist_covariance)

    def _twist(self) -> Tuple[float, float, np.ndarray]:
        """Mean twist over the window [m/s, rad/s] and its 2x2 covariance."""
        oldest, newest = self._totals[0], self._totals[-1]
        interval_s = (newest.stamp_ns - oldest.stamp_ns) / NANOSECONDS_PER_SECOND
        if interval_s == 0.0:
            return 0.0, 0.0, np.zeros((2, 2))
        left_m = (newest.left_pulses - oldest.left_pulses) * self._left_m_per_pulse
        right_m = (newest.right_pulses - oldest.right_pulses) * self._right_m_per_pulse
        jacobian = _twist_by_travel(self.params.wheel_separation, interval_s)
        linear_mps, angular_radps = (jacobian @ (left_m, right_m)).tolist()
        # A difference of two readings carries two independent rounding errors.
        travel_variance = [
            2.0 * PULSE_VARIANCE * m_per_pulse**2 + self.params.motion_noise * abs(travel_m)
            for m_per_pulse, travel_m in ((self._left_m_per_pulse, left_m), (self._right_m_per_pulse, right_m))
        ]
        return linear_mps, angular_radps, (jacobian * travel_variance) @ jacobian.T


# Reports come at one rate, so hardly ever another interval.
@functools.lru_cache(maxsize=16)
def _twist_by_travel(wheel_separation_m: float, interval_s: float) -> np.ndarray:
    """2x2 read-only; columns: what a metre of the left and of the right wheel adds to the twist."""
    jacobian = np.array([[0.5, 0.5], [-1.0, 1.0]])
    jacobian[1] /= wheel_separation_m
    jacobian /= interval_s
    jacobian.setflags(write=False)
    return jacobian
