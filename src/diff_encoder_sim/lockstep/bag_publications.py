"""A trial in lockstep, recorded as the live graph is: same topics, types and frames."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Callable, List, Optional, Union

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.encoders.wheel_encoder import EncoderSample
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.lockstep.publications import Publications
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.goal_status import Command, GoalStatus
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.trial_bag import TrialBag
from diff_encoder_sim.serialization.basic_messages import encode_clock, encode_command, encode_string
from diff_encoder_sim.serialization.goal_messages import SentGoal, encode_goal, encode_result
from diff_encoder_sim.serialization.joint_messages import encode_encoder_pulse, encode_joint_state
from diff_encoder_sim.serialization.map_messages import encode_map, encode_map_metadata
from diff_encoder_sim.serialization.model_messages import ModelStatesEncoder
from diff_encoder_sim.serialization.pose_messages import (
    encode_odometry,
    encode_pose_stamped,
    encode_pose_with_covariance,
)
from diff_encoder_sim.serialization.scan_messages import encode_scan
from diff_encoder_sim.serialization.transform_messages import encode_spatial_transform, encode_tf, encode_transform
from diff_encoder_sim.simulation.link_frames import LinkFrame, LinkFrames
from diff_encoder_sim.simulation.robot import expand_xacro
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Ending

# robot_state_publisher's publish_frequency, 50 Hz.
FRAMES_PERIOD_NS = 20_000_000

# What trial.launch gives the robot file for robot_description.
DESCRIPTION_ARGUMENTS = {'root_inertia': 'false'}


class BagPublications(Publications):
    """Writes what the bag wants; nothing is made of what it does not."""

    def __init__(self, bag: TrialBag, params: RobotParams) -> None:
        self._bag = bag
        self._params = params
        self._map_frame = params.amcl.global_frame_id
        self._odom_frame, self._base_frame = params.odometry.odom_frame, params.odometry.base_frame
        self._joints = params.encoder.left_joint, params.encoder.right_joint
        self._trial_node = topics.NAVIGATION_TRIAL_NODE
        self._goal: Optional[SentGoal] = None
        self._frames: Optional[LinkFrames] = None
        self._frames_published_ns = 0
        self._models: Optional[ModelStatesEncoder] = None

    def begin(self, trial: Trial, simulator: Simulator, robot_file: Union[str, Path]) -> None:
        """/trial, and on /tf_static where odometry begins if nothing localizes."""
        if trial.nav == 'scripted':
            self._trial_node = topics.SCRIPTED_DRIVE_NODE
        self._write(topics.TRIAL, self._trial_node, 0, lambda: encode_string(trial.model_dump_json()))
        if trial.nav == 'scripted':
            self._write(
                topics.TF_STATIC,
                self._trial_node,
                0,
                lambda: encode_tf(encode_transform(trial.test.start.pose(), 0, self._map_frame, self._odom_frame)),
            )
        if self._bag.wants(topics.TF):
            self._frames = LinkFrames(expand_xacro(robot_file, DESCRIPTION_ARGUMENTS))
        self._models = ModelStatesEncoder(simulator.world, simulator.robot_name)

    def ending(self, now_ns: int, ending: Ending) -> None:
        text = json.dumps({'outcome': ending.outcome.value, 'reason': ending.reason})
        self._write(topics.TRIAL_RESULT, self._trial_node, now_ns, lambda: encode_string(text))

    def map(self, grid: OccupancyGrid) -> None:
        self._write(topics.MAP, topics.MAP_NODE, 0, lambda: encode_map(grid, 0, self._map_frame))
        self._write(topics.MAP_METADATA, topics.MAP_NODE, 0, lambda: encode_map_metadata(grid, 0))

    def joint_states(self, joints: JointStates) -> None:
        now_ns = joints.stamp_ns
        self._write(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, lambda: encode_clock(now_ns))
        self._write(topics.JOINT_STATES, topics.SIMULATOR_NODE, now_ns, lambda: encode_joint_state(joints))
        if self._frames and now_ns - self._frames_published_ns >= FRAMES_PERIOD_NS:
            self._publish_frames(joints)

    def _publish_frames(self, joints: JointStates) -> None:
        """robot_state_publisher's part; what is fixed, once."""
        now_ns = joints.stamp_ns
        if self._frames_published_ns == 0:
            self._write(
                topics.TF_STATIC,
                topics.STATE_PUBLISHER_NODE,
                now_ns,
                lambda: self._frames_message(self._frames.fixed, now_ns),
            )
        self._frames_published_ns = now_ns
        self._write(
            topics.TF,
            topics.STATE_PUBLISHER_NODE,
            now_ns,
            lambda: self._frames_message(self._frames.turned(dict(zip(joints.names, joints.angles_rad))), now_ns),
        )

    @staticmethod
    def _frames_message(frames: List[LinkFrame], stamp_ns: int) -> bytes:
        return encode_tf(
            *(
                encode_spatial_transform(frame.translation_xyz_m, frame.quat_xyzw, stamp_ns, frame.parent, frame.child)
                for frame in frames
            )
        )

    def models(self, now_ns: int, simulator: Simulator) -> None:
        self._write(topics.MODEL_STATES, topics.SIMULATOR_NODE, now_ns, lambda: self._models.encode(simulator.base()))

    def world_pose(self, now_ns: int, base_pose_in_map: Pose2D) -> None:
        self._write(
            topics.WORLD_POSE,
            topics.WORLD_POSE_NODE,
            now_ns,
            lambda: encode_pose_stamped(base_pose_in_map, now_ns, self._map_frame),
        )

    def scan(self, scan: Scan) -> None:
        simulator = self._params.simulator
        self._write(
            topics.SCAN,
            topics.SIMULATOR_NODE,
            scan.stamp_ns,
            lambda: encode_scan(scan, simulator.laser_link, 1.0 / simulator.lidar.rate),
        )

    def encoder_pulse(self, now_ns: int, sample: EncoderSample) -> None:
        self._write(
            topics.ENCODER_PULSE, topics.ENCODER_NODE, now_ns, lambda: encode_encoder_pulse(sample, self._joints)
        )

    def odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        if self._params.odometry.publish_tf:
            self._publish_transform(
                now_ns,
                topics.ODOM_NODE,
                estimate.base_pose_in_odom,
                estimate.stamp_ns,
                self._odom_frame,
                self._base_frame,
            )
        self._write(
            topics.ODOM, topics.ODOM_NODE, now_ns, lambda: encode_odometry(estimate, self._odom_frame, self._base_frame)
        )

    def amcl_pose(self, now_ns: int, estimate: AmclEstimate) -> None:
        self._write(
            topics.AMCL_POSE,
            topics.AMCL_NODE,
            now_ns,
            lambda: encode_pose_with_covariance(
                estimate.base_pose_in_map, estimate.covariance, estimate.stamp_ns, self._map_frame
            ),
        )

    def odom_in_map(self, now_ns: int, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        self._publish_transform(now_ns, topics.AMCL_NODE, odom_pose_in_map, stamp_ns, self._map_frame, self._odom_frame)

    def _publish_transform(
        self, now_ns: int, node: str, child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str
    ) -> None:
        self._write(
            topics.TF,
            node,
            now_ns,
            lambda: encode_tf(encode_transform(child_pose, stamp_ns, parent_frame, child_frame)),
        )

    def global_pose(self, now_ns: int, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        self._write(
            topics.GLOBAL_POSE,
            topics.GLOBAL_POSE_NODE,
            now_ns,
            lambda: encode_pose_stamped(base_pose_in_map, stamp_ns, self._map_frame),
        )

    def command(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        node = topics.MOVE_BASE_NODE if is_navigators else self._trial_node
        self._write(topics.CMD_VEL, node, now_ns, lambda: encode_command(*command))

    def goal(self, now_ns: int, stamp_ns: int, goal_in_map: Pose2D) -> None:
        number = self._goal.number + 1 if self._goal else 1
        self._goal = SentGoal(self._trial_node, number, now_ns)
        self._write(
            topics.GOAL,
            self._trial_node,
            now_ns,
            lambda: encode_goal(self._goal, goal_in_map, stamp_ns, self._map_frame),
        )

    def goal_result(self, now_ns: int, status: GoalStatus, text: str) -> None:
        self._write(
            topics.RESULT, topics.MOVE_BASE_NODE, now_ns, lambda: encode_result(self._goal, status, text, now_ns)
        )

    def _write(self, topic: str, node: str, now_ns: int, make: Callable[[], bytes]) -> None:
        if self._bag.wants(topic):
            self._bag.write(topic, node, make(), now_ns)
