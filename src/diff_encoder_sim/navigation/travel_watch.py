"""Does the odometry see the robot move? An encoder that came off sends the same pose for ever."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.goal_status import Command


class TravelWatch:
    """Sums up the travel that was commanded since the odometry's pose last changed."""

    def __init__(self, limit_m: float, turning_radius_m: float) -> None:
        """Of a turn on the spot counts what a point at `turning_radius_m` travels."""
        self.limit_m = limit_m
        self._turning_radius_m = turning_radius_m
        self.forget()

    def forget(self) -> None:
        """Begin again."""
        self.unseen_m = 0.0
        self._pose: Optional[Pose2D] = None
        self._entered_ns = 0

    def enter(self, now_ns: int, base_pose_in_odom: Pose2D, command: Command) -> None:
        """Enter one control period: the newest pose, and the command since the last call."""
        if base_pose_in_odom != self._pose:
            self.unseen_m, self._pose = 0.0, base_pose_in_odom
        else:
            speed_mps = abs(command.linear_mps) + abs(command.angular_radps) * self._turning_radius_m
            self.unseen_m += speed_mps * max(0, now_ns - self._entered_ns) / NANOSECONDS_PER_SECOND
        self._entered_ns = now_ns

    @property
    def is_over_limit(self) -> bool:
        """Whether the robot may be driving blind; never with a limit of 0."""
        return 0.0 < self.limit_m < self.unseen_m
