"""What a trial in lockstep asks of its driver: of the navigation or of a script."""

from __future__ import annotations

from typing import Callable

from typing_extensions import Protocol

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, GoalStatus, NavigatorOutput, Phase

NO_NAVIGATION = NavigatorOutput(STOP, GoalStatus.NONE, Phase.PLANNING, '')

# Publishes a command at a time [ns]; True: it is the navigator's.
SendCommand = Callable[[int, Command, bool], None]


class Driver(Protocol):
    """Drives a robot: takes what its nodes would subscribe to, and sends commands."""

    @property
    def is_over(self) -> bool:
        """Return whether the robot rests at the end of the drive."""

    def take_time(self, now_ns: int) -> None:
        """Act on the time of a /world_pose; its pose is not for the driver. Raises RouteFailed."""

    def take_scan(self, scan: Scan) -> None:
        """Take a /scan."""
