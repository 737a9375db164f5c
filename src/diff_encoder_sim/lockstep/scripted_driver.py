"""A scripted drive in lockstep, as scripted_drive_node drives it live."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.lockstep.driver import NO_NAVIGATION, SendCommand
from diff_encoder_sim.lockstep.publications import Publications
from diff_encoder_sim.navigation.goal_status import Command
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_definition import TrialPlan


class ScriptedDriver:
    """Drives by time alone; odometry begins at the surveyed start pose, which places it on the map."""

    estimate = None
    navigation = NO_NAVIGATION

    def __init__(self, plan: TrialPlan, send: SendCommand, publications: Publications) -> None:
        self._drive = ScriptedDrive(plan.trial.test)
        self._start_pose = plan.trial.test.start.pose()
        self._send, self._publications = send, publications
        self.estimated_pose_in_map: Optional[Pose2D] = None
        self.is_over = False

    def take_time(self, now_ns: int) -> None:
        """Send the command for the period that begins."""
        elapsed_s = now_ns / NANOSECONDS_PER_SECOND
        self._send(now_ns, Command(*self._drive.command_at(elapsed_s)), False)
        self.is_over = self._drive.is_over(elapsed_s)

    def take_scan(self, scan: Scan) -> None:
        """Ignore it."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Publish it as /global_pose."""
        self.estimated_pose_in_map = self._start_pose.compose(estimate.base_pose_in_odom)
        self._publications.global_pose(now_ns, estimate.stamp_ns, self.estimated_pose_in_map)
