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

from diff_encoder_sim.config import Params
from diff_encoder_sim.encoder import (DEFAULT_PPR, CounterModulus, PulsesPerRevolution,
                                      count_difference)
from diff_encoder_sim.errors import EVENT
from diff_encoder_sim.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND, Step, Timeline

log = logging.getLogger(__name__)

# Reports come at 20 Hz or so; one that is further back than this belongs to a new run.
LATE_REPORT_TOLERANCE_NS = 100_000_000

# Variance of a position that is uniform within one pulse, in pulses squared.
PULSE_VARIANCE = 1.0 / 12.0

# Standard deviation, in pulses along x and along y, of what does not quite average out under way;
# measured by NEES (test/benchmark/quantisation.py).
RESIDUAL_PULSES = 0.03


class OdometryParams(Params):
    """Parameters of gz_diff_odom_node, under the names that users set.

    `wheel_diameter` and `wheel_separation` are what the robot believes of itself; the true
    geometry is the simulator's.
    """

    ppr: PulsesPerRevolution = DEFAULT_PPR
    wheel_diameter: float = Field(0.2, gt=0, description='[m]')
    wheel_separation: float = Field(0.4, gt=0, description='between the contact points [m]')
    counter_modulus: CounterModulus = 0
    velocity_window: int = Field(1, ge=1, description='report intervals that the twist spans')
    motion_noise: float = Field(
        1e-6, ge=0, description='variance of a wheel\'s travel per metre of it [m^2/m]')
    max_wheel_speed: float = Field(
        100.0, gt=0, description='a faster wheel [rad/s] is a counter that was restarted')
    odom_frame: str = Field('odom', min_length=1)
    base_frame: str = Field('base_link', min_length=1)
    publish_tf: bool = True


class OdometryEstimate(NamedTuple):
    """What the wheels tell at one instant."""

    stamp_ns: int
    base_pose_in_odom: Pose2D      # yaw in [-pi, pi)
    linear_velocity_mps: float     # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    pose_covariance: np.ndarray    # 3x3 over (x [m], y [m], yaw [rad]) in the odom frame
    twist_covariance: np.ndarray   # 2x2 over (linear [m/s], angular [rad/s])

    def twist_std(self) -> Tuple[float, float]:
        """Standard deviations of the twist, linear [m/s] and angular [rad/s]."""
        linear_std_mps, angular_std_radps = np.sqrt(np.diag(self.twist_covariance)).tolist()
        return linear_std_mps, angular_std_radps


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

    def update(self, stamp_ns: int, left_count: int,
               right_count: int) -> Optional[OdometryEstimate]:
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
            log.warning('encoder stamps went back to %.3f s: odometry restarted at pose zero',
                        stamp_ns / NANOSECONDS_PER_SECOND, extra=EVENT)
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
            log.warning('%d left and %d right pulses in %.3f s are faster than max_wheel_speed: '
                        'taken as a counter restart, the pose is kept',
                        left_pulses, right_pulses, interval_s, extra=EVENT)
            left_pulses = right_pulses = 0
        total = self._totals[-1]
        self._totals.append(_Report(report.stamp_ns, total.left_pulses + left_pulses,
                                    total.right_pulses + right_pulses))
        if left_pulses or right_pulses:
            self._move_pose(left_pulses * self._left_m_per_pulse,
                            right_pulses * self._right_m_per_pulse)

    def _move_pose(self, left_m: float, right_m: float) -> None:
        start = self._pose
        moved = move_along_arc(start, 0.5 * (left_m + right_m),
                               (right_m - left_m) / self.params.wheel_separation)
        # The heading comes from the totals: adding up rounded increments would let it drift.
        self._pose = moved._replace(yaw_rad=self._heading_rad(self._totals[-1]))
        self._motion_covariance = propagate_motion_noise(
            self._motion_covariance, start.yaw_rad, left_m, right_m,
            self.params.wheel_separation, self.params.motion_noise)

    def _heading_rad(self, total: _Report) -> float:
        return (total.right_pulses * self._right_m_per_pulse
                - total.left_pulses * self._left_m_per_pulse) / self.params.wheel_separation

    def _is_implausible(self, left_pulses: int, right_pulses: int, interval_s: float) -> bool:
        ppr = self.params.ppr
        turns = max(abs(left_pulses) / ppr.left, abs(right_pulses) / ppr.right)
        return 2.0 * math.pi * turns > self.params.max_wheel_speed * interval_s

    def _estimate(self, stamp_ns: int) -> OdometryEstimate:
        linear_mps, angular_radps, twist_covariance = self._twist()
        pose_covariance = self._motion_covariance + quantisation_covariance(
            self._pose, self._left_m_per_pulse, self._right_m_per_pulse,
            self.params.wheel_separation)
        wrapped_pose = IDENTITY.compose(self._pose)
        return OdometryEstimate(stamp_ns, wrapped_pose, linear_mps, angular_radps,
                                pose_covariance, twist_covariance)

    def _twist(self) -> Tuple[float, float, np.ndarray]:
        """Mean twist over the window [m/s, rad/s] and its 2x2 covariance."""
        oldest, newest = self._totals[0], self._totals[-1]
        interval_s = (newest.stamp_ns - oldest.stamp_ns) / NANOSECONDS_PER_SECOND
        if interval_s == 0.0:
            return 0.0, 0.0, np.zeros((2, 2))
        left_m = (newest.left_pulses - oldest.left_pulses) * self._left_m_per_pulse
        right_m = (newest.right_pulses - oldest.right_pulses) * self._right_m_per_pulse
        # Rows: what a metre of the left and of the right wheel adds to the twist.
        jacobian = np.array([[0.5, 0.5], [-1.0, 1.0]])
        jacobian[1] /= self.params.wheel_separation
        jacobian /= interval_s
        linear_mps, angular_radps = jacobian @ (left_m, right_m)
        # A difference of two readings carries two independent rounding errors.
        travel_variance = [
            2.0 * PULSE_VARIANCE * m_per_pulse ** 2 + self.params.motion_noise * abs(travel_m)
            for m_per_pulse, travel_m in ((self._left_m_per_pulse, left_m),
                                          (self._right_m_per_pulse, right_m))]
        covariance = jacobian @ np.diag(travel_variance) @ jacobian.T
        return float(linear_mps), float(angular_radps), covariance


def propagate_motion_noise(covariance: np.ndarray, yaw_rad: float, left_m: float, right_m: float,
                           wheel_separation_m: float, motion_noise: float) -> np.ndarray:
    """3x3 covariance of (x, y, yaw) after one more step of both wheels.

    Siegwart and Nourbakhsh, Introduction to Autonomous Mobile Robots, section 5.2.4: each
    wheel's travel has a variance proportional to its length and independent of the other's.

    Args:
        covariance: 3x3, before the step.
        yaw_rad: heading before the step.
        left_m: travel of the left wheel; right_m: of the right.
        wheel_separation_m: between the contact points.
        motion_noise: variance per metre of travel [m^2/m].
    """
    travel_m = 0.5 * (left_m + right_m)
    mid_yaw_rad = yaw_rad + 0.5 * (right_m - left_m) / wheel_separation_m
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    pose_jacobian = np.array([[1.0, 0.0, -travel_m * sin_yaw],
                              [0.0, 1.0, travel_m * cos_yaw],
                              [0.0, 0.0, 1.0]])
    lever = 0.5 * travel_m / wheel_separation_m
    wheel_jacobian = np.array([
        [0.5 * cos_yaw + lever * sin_yaw, 0.5 * cos_yaw - lever * sin_yaw],
        [0.5 * sin_yaw - lever * cos_yaw, 0.5 * sin_yaw + lever * cos_yaw],
        [-1.0 / wheel_separation_m, 1.0 / wheel_separation_m]])
    wheel_variance = motion_noise * np.abs((left_m, right_m))
    return (pose_jacobian @ covariance @ pose_jacobian.T
            + (wheel_jacobian * wheel_variance) @ wheel_jacobian.T)


def quantisation_covariance(base_pose_in_odom: Pose2D, left_m_per_pulse: float,
                            right_m_per_pulse: float, wheel_separation_m: float) -> np.ndarray:
    """3x3 covariance of (x, y, yaw) that whole pulses cause: bounded, no random walk.

    Each wheel stands anywhere within a pulse twice: at the start and now. What it had left of its
    pulse at the start turns and shifts the whole path about the start; what it has left now turns
    and shifts the robot where it stands. In between, the rounding averages out. For a straight
    drive of length S this gives the lateral spread (S d/L) sqrt(1/6), and everywhere the heading
    spread (d/L) sqrt(1/3) (docs/adr/0002-odometry-covariance.md).
    """
    x_m, y_m, yaw_rad = base_pose_in_odom
    cos_yaw, sin_yaw = math.cos(yaw_rad), math.sin(yaw_rad)
    # Each column: where a wheel's travel of one metre, at the start or now, moves the pose.
    columns = np.array([
        [0.5 + y_m / wheel_separation_m, 0.5 - y_m / wheel_separation_m,
         0.5 * cos_yaw, 0.5 * cos_yaw],
        [-x_m / wheel_separation_m, x_m / wheel_separation_m, 0.5 * sin_yaw, 0.5 * sin_yaw],
        np.array([-1.0, 1.0, -1.0, 1.0]) / wheel_separation_m])
    pulse_m = np.array([left_m_per_pulse, right_m_per_pulse] * 2)
    residual_m = RESIDUAL_PULSES * max(left_m_per_pulse, right_m_per_pulse)
    return (PULSE_VARIANCE * (columns * pulse_m ** 2) @ columns.T
            + np.diag([residual_m ** 2, residual_m ** 2, 0.0]))
