"""What the parts of a trial in lockstep publish, topic by topic."""

from __future__ import annotations

from pathlib import Path
from typing import Union

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_outcome import Ending
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.goal_status import Command, GoalStatus
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.wheels.encoder_sample import EncoderSample
from diff_encoder_sim.wheels.wheel_odometry import OdometryEstimate


class Publications:
    """One method for each publication on the live graph, at `now_ns`. Here they do nothing; a subclass may record."""

    def trial(self, trial: Trial) -> None:
        """Publish /trial, first of all."""

    def begin(self, trial: Trial, simulator: Simulator, robot_file: Union[str, Path]) -> None:
        """Publish what stands still on /tf_static, before time runs."""

    def ending(self, now_ns: int, ending: Ending) -> None:
        """Publish /trial_result."""

    def map(self, grid: OccupancyGrid) -> None:
        """Publish /map and /map_metadata, before time runs."""

    def joint_states(self, joints: JointStates) -> None:
        """Publish /clock and /joint_states at each tick, and the wheels' frames on /tf."""

    def models(self, now_ns: int, simulator: Simulator) -> None:
        """Publish /gazebo/model_states."""

    def world_pose(self, now_ns: int, base_pose_in_map: Pose2D) -> None:
        """Publish /world_pose, the true pose."""

    @property
    def takes_scans(self) -> bool:
        """Return whether `scan` does anything; where nobody else does either, none are taken."""
        return False

    def scan(self, scan: Scan) -> None:
        """Publish /scan."""

    def encoder_pulse(self, now_ns: int, sample: EncoderSample) -> None:
        """Publish /encoder_pulse and, where speeds are measured, /encoder_velocity."""

    def odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Publish /odom, and odom->base_link on /tf."""

    def amcl_pose(self, now_ns: int, estimate: AmclEstimate) -> None:
        """Publish /amcl_pose."""

    def odom_in_map(self, now_ns: int, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        """Publish map->odom on /tf, with its stamp."""

    def global_pose(self, now_ns: int, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        """Publish /global_pose, the pose estimate."""

    def command(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        """Publish /cmd_vel, by the navigator or by the trial's own node."""

    def goal(self, now_ns: int, stamp_ns: int, goal_in_map: Pose2D) -> None:
        """Publish /move_base/goal; the stamp is that of the pose estimate at which it was sent."""

    def goal_result(self, now_ns: int, status: GoalStatus, text: str) -> None:
        """Publish /move_base/result of the goal sent last."""
