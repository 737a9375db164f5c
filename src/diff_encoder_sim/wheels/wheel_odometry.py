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

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.wheels.counter_steps import CounterSteps, Reading
from diff_encoder_sim.wheels.geometry_uncertainty import (
    KNOWN_EXACTLY,
    NO_ERRORS,
    carry_geometry_errors,
    geometry_covariance,
)
from diff_encoder_sim.wheels.lateral_acceleration import LateralAcceleration
from diff_encoder_sim.wheels.odometry_covariance import (
    PlanarCovariance,
    behind_axle,
    propagate_motion_noise,
    quantisation_covariance,
    residual_std,
)
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS
from diff_encoder_sim.wheels.wheel_twist import TwistCovariance, TwistEstimator, WheelRates

log = logging.getLogger(__name__)


class OdometryEstimate(NamedTuple):
    """Pose and twist by the wheels at one instant."""

    stamp_ns: int
    base_pose_in_odom: Pose2D  # yaw in [-pi, pi)
    linear_velocity_mps: float  # along base_link's x, signed
    angular_velocity_radps: float  # counter-clockwise
    of_pose: PlanarCovariance = PlanarCovariance()  # in the odom frame
    of_twist: TwistCovariance = TwistCovariance()
    lateral_velocity_mps: float = 0.0  # along base_link's y: where base_link is not on the axle, it swings in turns

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
        self._steps, self._twists = CounterSteps(params), TwistEstimator(params)
        self._pull = LateralAcceleration(params.wheel_separation)
        self.reset()

    def reset(self) -> None:
        """Return to pose zero; the next report of a new stamp, whatever it counts, is the start."""
        self._steps.reset()
        self._twists.reset()
        self._pull.reset()
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
            self._totals.append(reading._replace(left_pulses=0, right_pulses=0))
            return
        if step.restart:
            log.warning('%s: taken as a counter restart, the pose is kept', step.restart, extra=EVENT)
        left_pulses, right_pulses = step.left_pulses, step.right_pulses
        total = self._totals[-1]
        self._totals.append(
            Reading(reading.stamp_ns, total.left_pulses + left_pulses, total.right_pulses + right_pulses)
        )
        left_m, right_m = left_pulses * self._m_per_pulse[0], right_pulses * self._m_per_pulse[1]
        pull_mps2 = self._pull.take((reading.stamp_ns - total.stamp_ns) / NANOSECONDS_PER_SECOND, left_m, right_m)
        if left_pulses or right_pulses:
            self._move_pose(left_m, right_m, pull_mps2)

    def _move_pose(self, left_m: float, right_m: float, pull_mps2: float) -> None:
        start = self._pose
        moved = move_along_arc(start, 0.5 * (left_m + right_m), (right_m - left_m) / self.params.wheel_separation)
        # The heading comes from the totals: adding up rounded increments would let it drift.
        self._pose = moved._replace(yaw_rad=self._heading_rad(self._totals[-1]))
        step = start.yaw_rad, left_m, right_m, self.params.wheel_separation
        noise = self.params.travel_variance + (self.params.curve_noise or 0.0) * pull_mps2**2
        self._motion_covariance = propagate_motion_noise(self._motion_covariance, *step, noise, self._heading_var_rad2)
        if self._geometry_std != KNOWN_EXACTLY:
            self._geometry_errors = carry_geometry_errors(self._geometry_errors, self._geometry_std, *step)

    def _heading_rad(self, total: Reading) -> float:
        left_m_per_pulse, right_m_per_pulse = self._m_per_pulse
        travel_m = total.right_pulses * right_m_per_pulse - total.left_pulses * left_m_per_pulse
        return travel_m / self.params.wheel_separation

    def _estimate(self, stamp_ns: int, wheel_rates_radps: Optional[WheelRates]) -> OdometryEstimate:
        twist = self._twists.twist(self._totals, wheel_rates_radps)
        axle_x_m = self.params.axle_x
        pose_covariance = self._axle_covariance()
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

    def _axle_covariance(self) -> PlanarCovariance:
        """Return the covariance of the axle's middle."""
        covariance = self._motion_covariance.plus(
            quantisation_covariance(self._pose, *self._reading_vars_m2, self._residual_m, self.params.wheel_separation)
        )
        if self._geometry_std != KNOWN_EXACTLY:
            covariance = covariance.plus(geometry_covariance(self._geometry_errors, self._geometry_std))
        return covariance

    def _base_pose(self) -> Pose2D:
        """Return the pose of base_frame: the axle's, moved back along its x on the way there and at its end."""
        axle, axle_x_m = IDENTITY.compose(self._pose), self.params.axle_x
        return axle._replace(
            x_m=axle.x_m + axle_x_m * (1.0 - math.cos(axle.yaw_rad)), y_m=axle.y_m - axle_x_m * math.sin(axle.yaw_rad)
        )
