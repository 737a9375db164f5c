"""Turning in place by what the robot believes of its heading."""
from __future__ import annotations

import math
from typing import Optional

from diff_encoder_sim.experiments.definition import SpeedLimits
from diff_encoder_sim.se2 import wrap_angle
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND

# Braking begins early enough for a deceleration of this share of the limit: commands take a
# while to take effect.
BRAKING_SHARE = 0.3
STOP_WITHIN_RAD = 0.02


class TurnInPlace:
    """Speeds up, turns, and slows down towards a total angle that may be many turns."""

    def __init__(self, angle_rad: float, limits: SpeedLimits) -> None:
        self._angle_rad = angle_rad
        self._limits = limits
        self._turned_rad = 0.0
        self._rate_radps = 0.0
        self._last_yaw_rad: Optional[float] = None
        self._last_ns = 0
        self.is_over = False

    def rate(self, now_ns: int, yaw_rad: float) -> float:
        """Angular velocity to command [rad/s], given the heading believed now."""
        interval_s = 0.0
        if self._last_yaw_rad is not None:
            self._turned_rad += wrap_angle(yaw_rad - self._last_yaw_rad)
            interval_s = (now_ns - self._last_ns) / NANOSECONDS_PER_SECOND
        self._last_yaw_rad, self._last_ns = yaw_rad, now_ns
        left_rad = self._angle_rad - self._turned_rad
        if abs(left_rad) < STOP_WITHIN_RAD:
            self.is_over = True
            return 0.0
        limits = self._limits
        braking_radps = math.sqrt(2.0 * BRAKING_SHARE * limits.angular_acceleration
                                  * abs(left_rad))
        wanted_radps = math.copysign(min(limits.angular_speed, braking_radps), left_rad)
        change_radps = limits.angular_acceleration * interval_s
        self._rate_radps += max(-change_radps, min(change_radps, wanted_radps - self._rate_radps))
        return self._rate_radps
