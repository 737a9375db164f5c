"""Prevention of oscillation: once the robot has reversed a direction, it keeps the new one for a while.

base_local_planner's OscillationCostFunction, for forward and backward and for left and right.
"""

from __future__ import annotations

from typing import Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams


class _Direction:
    """Last direction along one axis, and the one that it is locked to."""

    def __init__(self) -> None:
        self._last_sign = 0
        self.only_sign = 0

    def enter(self, velocity: float) -> bool:
        """Enter a command; return whether it reverses the one before."""
        sign = (velocity > 0.0) - (velocity < 0.0)
        if sign == 0:
            return False
        reverses = self._last_sign == -sign
        self._last_sign = sign
        if reverses:
            self.only_sign = sign
        return reverses

    def allows(self, sign: int) -> bool:
        """Return whether a command of this sign is allowed."""
        return self.only_sign != -sign


class OscillationMemory:
    """Directions that past commands rule out until the robot has moved away from where it reversed."""

    def __init__(self, params: DwaParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """Allow all directions."""
        self._linear, self._angular = _Direction(), _Direction()
        self._reversed_at: Optional[Pose2D] = None

    def allowed(self) -> Tuple[bool, bool, bool, bool]:
        """Return whether forward, backward, left and right are allowed."""
        linear, angular = self._linear, self._angular
        return linear.allows(1), linear.allows(-1), angular.allows(1), angular.allows(-1)

    def update(self, base_pose: Pose2D, linear_mps: float, angular_radps: float) -> None:
        """Enter the command that was chosen at a pose."""
        reversed_now = self._linear.enter(linear_mps)
        # A robot that drives on may weave: turns count only (nearly) in place.
        if abs(linear_mps) <= self._params.min_vel_trans:
            reversed_now = self._angular.enter(angular_radps) or reversed_now
        if reversed_now:
            self._reversed_at = base_pose
        if self._reversed_at is not None and self._has_moved_away(base_pose, self._reversed_at):
            self.reset()

    def _has_moved_away(self, base_pose: Pose2D, since: Pose2D) -> bool:
        params = self._params
        squared_m = (base_pose.x_m - since.x_m) ** 2 + (base_pose.y_m - since.y_m) ** 2
        turned_rad = abs(wrap_angle(base_pose.yaw_rad - since.yaw_rad))
        return squared_m > params.oscillation_reset_dist**2 or turned_rad > params.oscillation_reset_angle
