"""Turns in place by the estimated heading."""

from __future__ import annotations

import math
from typing import Optional

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.test_definition import SpeedLimits

# The robot slows down with at most this fraction of the deceleration limit, and in the end in proportion to the angle
# left: commands take a while to take effect, and it must not overshoot.
BRAKING_FRACTION = 0.3
APPROACH_PER_S = 1.5
STOP_WITHIN_RAD = 0.02

# A heading estimate that jumps across the end, as it does below 40 PPR, comes no nearer after so many crossings.
MOST_CROSSINGS = 2


class TurnInPlace:
    """Speeds up, turns, and slows down towards a total angle that may be many turns."""

    def __init__(self, angle_rad: float, limits: SpeedLimits) -> None:
        self._angle_rad = angle_rad
        self._limits = limits
        self._turned_rad = 0.0
        self._crossings = 0
        self._rate_radps = 0.0
        self._last_yaw_rad: Optional[float] = None
        self._last_ns: Optional[int] = None
        self.is_over = False

    def rate(self, now_ns: int, yaw_rad: float) -> float:
        """Return the angular velocity to command [rad/s] at the heading estimated now.

        While the heading is not finite, the robot slows down and stops; what it turns meanwhile, up to half a turn, is
        counted afterwards.
        """
        last_ns = now_ns if self._last_ns is None else self._last_ns
        interval_s = max(0, now_ns - last_ns) / NANOSECONDS_PER_SECOND
        self._last_ns = now_ns
        target_radps = self._target_rate(yaw_rad) if math.isfinite(yaw_rad) else 0.0
        if self.is_over:
            return 0.0
        change_radps = self._limits.angular_acceleration * interval_s
        self._rate_radps += max(-change_radps, min(change_radps, target_radps - self._rate_radps))
        return self._rate_radps

    def halt(self) -> None:
        """Speed up from rest at the next heading: the robot was stopped."""
        self._rate_radps, self._last_ns = 0.0, None

    def _target_rate(self, yaw_rad: float) -> float:
        """Count what was turned, and return the rate to speed up or slow down to [rad/s]."""
        left_before_rad = self._angle_rad - self._turned_rad
        if self._last_yaw_rad is not None:
            self._turned_rad += wrap_angle(yaw_rad - self._last_yaw_rad)
        self._last_yaw_rad = yaw_rad
        left_rad = self._angle_rad - self._turned_rad
        self._crossings += left_rad * left_before_rad < 0.0
        self.is_over = abs(left_rad) < STOP_WITHIN_RAD or self._crossings >= MOST_CROSSINGS
        braking_radps = math.sqrt(2.0 * BRAKING_FRACTION * self._limits.angular_acceleration * abs(left_rad))
        return math.copysign(min(self._limits.angular_speed, braking_radps, APPROACH_PER_S * abs(left_rad)), left_rad)
