"""What the parts of a trial in lockstep say, topic by topic; who listens, redefines it."""

from __future__ import annotations

from pathlib import Path
from typing import Union

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.encoders.wheel_encoder import EncoderSample
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.goal_status import Command, GoalStatus
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Ending


class Publications:
    """Nobody listens. Each method is one publication on the live graph's topics, at `now_ns`."""

    def begin(self, trial: Trial, simulator: Simulator, robot_file: Union[str, Path]) -> None:
        """/trial, before time runs."""

    def ending(self, now_ns: int, ending: Ending) -> None:
        """/trial_result."""

    def map(self, grid: OccupancyGrid) -> None:
        """/map and /map_metadata, before time runs."""

    def joint_states(self, joints: JointStates) -> None:
        """/clock and /joint_states of each tick, and the wheels on /tf."""

    def models(self, now_ns: int, simulator: Simulator) -> None:
        """/gazebo/model_states."""

    def world_pose(self, now_ns: int, base_pose_in_map: Pose2D) -> None:
        """/world_pose: the truth."""

    def scan(self, scan: Scan) -> None:
        """/scan."""

    def encoder_pulse(self, now_ns: int, sample: EncoderSample) -> None:
        """/encoder_pulse."""

    def odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """/odom, and odom->base_link on /tf."""

    def amcl_pose(self, now_ns: int, estimate: AmclEstimate) -> None:
        """/amcl_pose."""

    def odom_in_map(self, now_ns: int, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        """map->odom on /tf, with its stamp."""

    def global_pose(self, now_ns: int, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        """/global_pose: where the robot believes to be."""

    def command(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        """/cmd_vel, from the navigator or from who drives the trial."""

    def goal(self, now_ns: int, stamp_ns: int, goal_in_map: Pose2D) -> None:
        """/move_base/goal; the stamp is that of the pose at which it was decided."""

    def goal_result(self, now_ns: int, status: GoalStatus, text: str) -> None:
        """/move_base/result of the goal sent last."""
