"""What a trial in lockstep asks of its driver: of the navigation or of a script."""

from __future__ import annotations

from typing import Callable, Optional

from typing_extensions import Protocol

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.navigation.goal_status import STOP, Command, GoalStatus, NavigatorOutput, Phase
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate

NO_NAVIGATION = NavigatorOutput(STOP, GoalStatus.NONE, Phase.PLANNING, '')

# Publishes a command at a time [ns]; True: it is the navigator's.
SendCommand = Callable[[int, Command, bool], None]


class Driver(Protocol):
    """Drives a trial: takes what its nodes would subscribe to, and sends commands."""

    @property
    def is_over(self) -> bool:
        """Return whether the robot rests at the end of the drive."""

    @property
    def estimate(self) -> Optional[AmclEstimate]:
        """Return AMCL's newest estimate, None without one."""

    @property
    def estimated_pose_in_map(self) -> Optional[Pose2D]:
        """Return the newest /global_pose, None before the first."""

    @property
    def navigation(self) -> NavigatorOutput:
        """Return the navigator's newest output."""

    def take_time(self, now_ns: int) -> None:
        """Act on the time of a /world_pose; its pose is not for the driver. Raises RouteFailed."""

    def take_scan(self, scan: Scan) -> None:
        """Take a /scan."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Act on an /odom. Raises RouteFailed."""
