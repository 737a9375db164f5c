"""Watch for odometry that does not move: a detached encoder reports the same pose forever."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.goal_status import Command


class TravelWatch:
    """Sums the commanded travel since the odometry's pose last changed.

    Args:
        limit_m: travel above which the robot may be driving blind; 0: no limit.
        turning_radius_m: a turn in place counts as the travel of a point at this radius.
    """

    def __init__(self, limit_m: float, turning_radius_m: float) -> None:
        self.limit_m = limit_m
        self._turning_radius_m = turning_radius_m
        self.reset()

    def reset(self) -> None:
        """Set the sum to zero and forget the last pose."""
        self.unseen_m = 0.0
        self._pose: Optional[Pose2D] = None
        self._updated_ns = 0

    def update(self, now_ns: int, base_pose_in_odom: Pose2D, command: Command) -> None:
        """Enter one control period: the newest pose, and the command since the last call."""
        if base_pose_in_odom != self._pose:
            self.unseen_m, self._pose = 0.0, base_pose_in_odom
        else:
            speed_mps = abs(command.linear_mps) + abs(command.angular_radps) * self._turning_radius_m
            self.unseen_m += speed_mps * max(0, now_ns - self._updated_ns) / NANOSECONDS_PER_SECOND
        self._updated_ns = now_ns

    @property
    def is_over_limit(self) -> bool:
        """Return whether the travel is above the limit; never True for a limit of 0."""
        return 0.0 < self.limit_m < self.unseen_m
