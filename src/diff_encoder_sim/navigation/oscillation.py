"""Memory against oscillation: once the robot has turned back, it stays with the new direction.

base_local_planner's OscillationCostFunction, for forward and backward and for left and right.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams


class _Direction:
    """One axis: which way it went last, and which way alone it may go."""

    def __init__(self) -> None:
        self._last_sign = 0
        self.only_sign = 0

    def take(self, velocity: float) -> bool:
        """Enter a command; True when it reverses the one before."""
        sign = (velocity > 0.0) - (velocity < 0.0)
        if sign == 0:
            return False
        reverses = self._last_sign == -sign
        self._last_sign = sign
        if reverses:
            self.only_sign = sign
        return reverses

    def allows(self, sign: int) -> bool:
        """Whether a command of this sign may be given."""
        return self.only_sign != -sign


class OscillationMemory:
    """What past commands forbid the next one, until the robot has got away."""

    def __init__(self, params: DwaParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """Everything is allowed again."""
        self._linear, self._angular = _Direction(), _Direction()
        self._turned_back_at: Optional[Pose2D] = None

    def allowed(self) -> np.ndarray:
        """(4,) bool: forward, backward, left, right."""
        return np.array(
            [self._linear.allows(1), self._linear.allows(-1), self._angular.allows(1), self._angular.allows(-1)]
        )

    def update(self, base_pose: Pose2D, linear_mps: float, angular_radps: float) -> None:
        """Enter the command that was chosen at a pose."""
        reversed_now = self._linear.take(linear_mps)
        # A robot that moves on may weave: turning counts only (nearly) on the spot.
        if abs(linear_mps) <= self._params.min_vel_trans:
            reversed_now = self._angular.take(angular_radps) or reversed_now
        if reversed_now:
            self._turned_back_at = base_pose
        if self._turned_back_at is not None and self._has_got_away(base_pose, self._turned_back_at):
            self.reset()

    def _has_got_away(self, base_pose: Pose2D, since: Pose2D) -> bool:
        params = self._params
        squared_m = (base_pose.x_m - since.x_m) ** 2 + (base_pose.y_m - since.y_m) ** 2
        turned_rad = abs(wrap_angle(base_pose.yaw_rad - since.yaw_rad))
        return squared_m > params.oscillation_reset_dist**2 or turned_rad > params.oscillation_reset_angle
