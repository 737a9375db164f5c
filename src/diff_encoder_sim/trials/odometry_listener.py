"""What a trial in lockstep has for its odometry: the navigation, or in a scripted drive a look at the start."""

from __future__ import annotations

from typing import Optional

from typing_extensions import Protocol

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.navigation.navigator_inputs import NavigatorOutput
from diff_encoder_sim.trials.driver import NO_NAVIGATION
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.wheels.odometry import OdometryEstimate


class OdometryListener(Protocol):
    """Takes a trial's odometry, and knows by it where the robot is."""

    @property
    def estimate(self) -> Optional[AmclEstimate]:
        """Return AMCL's newest estimate, None without one."""

    @property
    def estimated_pose_in_map(self) -> Optional[Pose2D]:
        """Return the newest /global_pose, None before the first."""

    @property
    def navigation(self) -> NavigatorOutput:
        """Return the navigator's newest output."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Act on an /odom. Raises RouteFailed."""


class SurveyedStart:
    """Places odometry, which begins there, at the surveyed start pose, as scripted_drive_node's transform does."""

    estimate = None
    navigation = NO_NAVIGATION

    def __init__(self, start_pose_in_map: Pose2D, publications: Publications) -> None:
        self._start_pose_in_map, self._publications = start_pose_in_map, publications
        self.estimated_pose_in_map: Optional[Pose2D] = None

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Publish it as /global_pose."""
        self.estimated_pose_in_map = self._start_pose_in_map.compose(estimate.base_pose_in_odom)
        self._publications.global_pose(now_ns, estimate.stamp_ns, self.estimated_pose_in_map)
