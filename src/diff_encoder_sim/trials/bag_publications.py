"""A trial in lockstep, recorded to a bag as the live graph is: the same topics, types and frames."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Optional, Union

from typing_extensions import override

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.basic_messages import encode_clock, encode_command, encode_string
from diff_encoder_sim.drives.goal_messages import SentGoal, encode_goal, encode_result
from diff_encoder_sim.drives.joint_messages import encode_encoder_pulse, encode_joint_state, encode_wheel_speeds
from diff_encoder_sim.drives.map_messages import encode_map, encode_map_metadata
from diff_encoder_sim.drives.model_messages import ModelStatesEncoder
from diff_encoder_sim.drives.pose_messages import encode_odometry, encode_pose_stamped, encode_pose_with_covariance
from diff_encoder_sim.drives.scan_messages import encode_scan
from diff_encoder_sim.drives.transform_messages import encode_planar_tf
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_bags import TrialBags
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_outcome import Ending
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.goal_status import Command, GoalStatus
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.state_publisher import StatePublisher
from diff_encoder_sim.wheels.encoder_sample import EncoderSample
from diff_encoder_sim.wheels.wheel_odometry import OdometryEstimate


class BagPublications(Publications):
    """Writes the messages that the bag records; others are not encoded."""

    def __init__(self, bag: Union[TrialBag, TrialBags], params: RobotParams, nav: str) -> None:
        self._bag = bag
        self._params = params
        self._map_frame = params.amcl.global_frame_id
        self._odom_frame, self._base_frame = params.odometry.odom_frame, params.odometry.base_frame
        self._joints = params.encoder.left_joint, params.encoder.right_joint
        self._trial_node = topics.SCRIPTED_DRIVE_NODE if nav == 'scripted' else topics.NAVIGATION_TRIAL_NODE
        self._goal = SentGoal(self._trial_node, 0, 0)  # before the first
        self._state_publisher: Optional[StatePublisher] = None  # where the bag records /tf
        self._models: Optional[ModelStatesEncoder] = None  # where it records /gazebo/model_states

    @override
    def trial(self, trial: Trial) -> None:
        self._bag.publish(topics.TRIAL, self._trial_node, 0, encode_string, trial.model_dump_json())

    @override
    def begin(self, trial: Trial, simulator: Simulator, robot_file: Union[str, Path]) -> None:
        if trial.nav == 'scripted':
            start = trial.test.start.pose()  # without localization, odom is where the robot starts
            self._write_transform(topics.TF_STATIC, self._trial_node, 0, start, 0, self._map_frame, self._odom_frame)
        if self._bag.wants(topics.MODEL_STATES):
            self._models = ModelStatesEncoder(simulator.world, simulator.robot_name)
        if self._bag.wants(topics.TF):
            self._state_publisher = StatePublisher(robot_file, simulator.joint_states().names, self._bag)

    @override
    def ending(self, now_ns: int, ending: Ending) -> None:
        text = json.dumps({'outcome': ending.outcome.value, 'reason': ending.reason})
        self._bag.publish(topics.TRIAL_RESULT, self._trial_node, now_ns, encode_string, text)

    @override
    def map(self, grid: OccupancyGrid) -> None:
        self._bag.publish(topics.MAP, topics.MAP_NODE, 0, encode_map, grid, 0, self._map_frame)
        self._bag.publish(topics.MAP_METADATA, topics.MAP_NODE, 0, encode_map_metadata, grid, 0)

    @override
    def joint_states(self, joints: JointStates) -> None:
        now_ns = joints.stamp_ns
        self._bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, encode_clock, now_ns)
        self._bag.publish(topics.JOINT_STATES, topics.SIMULATOR_NODE, now_ns, encode_joint_state, joints)
        if self._state_publisher is not None:
            self._state_publisher.take(joints)

    @override
    def models(self, now_ns: int, simulator: Simulator) -> None:
        if self._models is not None:
            self._bag.publish(topics.MODEL_STATES, topics.SIMULATOR_NODE, now_ns, self._models.encode, simulator.base())

    @override
    def world_pose(self, now_ns: int, base_pose_in_map: Pose2D) -> None:
        self._write_pose(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, now_ns, base_pose_in_map)

    @property
    @override
    def takes_scans(self) -> bool:
        return self._bag.wants(topics.SCAN)

    @override
    def scan(self, scan: Scan) -> None:
        laser, duration_s = self._params.simulator.laser_link, 1.0 / self._params.simulator.lidar.rate
        self._bag.publish(topics.SCAN, topics.SIMULATOR_NODE, scan.stamp_ns, encode_scan, scan, laser, duration_s)

    @override
    def encoder_pulse(self, now_ns: int, sample: EncoderSample) -> None:
        joints, speeds_radps = self._joints, sample.wheel_rates_radps
        if speeds_radps is not None:
            speeds = sample.stamp_ns, speeds_radps, joints
            self._bag.publish(topics.ENCODER_VELOCITY, topics.ENCODER_NODE, now_ns, encode_wheel_speeds, *speeds)
        self._bag.publish(topics.ENCODER_PULSE, topics.ENCODER_NODE, now_ns, encode_encoder_pulse, sample, joints)

    @override
    def odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        frames = self._odom_frame, self._base_frame
        if self._params.odometry.publish_tf:
            pose, stamp_ns = estimate.base_pose_in_odom, estimate.stamp_ns
            self._write_transform(topics.TF, topics.ODOM_NODE, now_ns, pose, stamp_ns, *frames)
        self._bag.publish(topics.ODOM, topics.ODOM_NODE, now_ns, encode_odometry, estimate, *frames)

    @override
    def amcl_pose(self, now_ns: int, estimate: AmclEstimate) -> None:
        message = estimate.base_pose_in_map, estimate.covariance, estimate.stamp_ns, self._map_frame
        self._bag.publish(topics.AMCL_POSE, topics.AMCL_NODE, now_ns, encode_pose_with_covariance, *message)

    @override
    def odom_in_map(self, now_ns: int, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        frames = self._map_frame, self._odom_frame
        self._write_transform(topics.TF, topics.AMCL_NODE, now_ns, odom_pose_in_map, stamp_ns, *frames)

    @override
    def global_pose(self, now_ns: int, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        self._write_pose(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, now_ns, stamp_ns, base_pose_in_map)

    @override
    def command(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        node = topics.MOVE_BASE_NODE if is_navigators else self._trial_node
        self._bag.publish(topics.CMD_VEL, node, now_ns, encode_command, *command)

    @override
    def goal(self, now_ns: int, stamp_ns: int, goal_in_map: Pose2D) -> None:
        self._goal = SentGoal(self._trial_node, self._goal.number + 1, now_ns)
        goal = self._goal, goal_in_map, stamp_ns, self._map_frame
        self._bag.publish(topics.GOAL, self._trial_node, now_ns, encode_goal, *goal)

    @override
    def goal_result(self, now_ns: int, status: GoalStatus, text: str) -> None:
        result = self._goal, status, text, now_ns
        self._bag.publish(topics.RESULT, topics.MOVE_BASE_NODE, now_ns, encode_result, *result)

    def _write_pose(self, topic: str, node: str, now_ns: int, stamp_ns: int, pose_in_map: Pose2D) -> None:
        self._bag.publish(topic, node, now_ns, encode_pose_stamped, pose_in_map, stamp_ns, self._map_frame)

    def _write_transform(
        self, topic: str, node: str, now_ns: int, child_pose: Pose2D, stamp_ns: int, parent: str, child: str
    ) -> None:
        self._bag.publish(topic, node, now_ns, encode_planar_tf, child_pose, stamp_ns, parent, child)
