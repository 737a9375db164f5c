"""Publications of a lockstep trial, by topic."""

from __future__ import annotations

import json
from pathlib import Path
from typing import List, Optional

from diff_encoder_sim.base.imu import ImuSample
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Ending, Trial
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.navigator_inputs import Command, GoalStatus
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.link_frames import LinkFrame, LinkFrames, display_urdf
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.report_link import EncoderSample

FRAMES_PERIOD_NS = 20_000_000  # robot_state_publisher's publish_frequency, 50 Hz


def _encode_turned(frames: LinkFrames, joints: JointStates) -> bytes:
    return _encode_frames(frames.turned(dict(zip(joints.names, joints.angles_rad))), joints.stamp_ns)


def _encode_frames(frames: List[LinkFrame], stamp_ns: int) -> bytes:
    encode = encoders.encode_spatial_transform
    places = ((each.translation_xyz_m, each.quat_xyzw, stamp_ns, each.parent, each.child) for each in frames)
    return encoders.encode_tf(*(encode(*place) for place in places))


class Publications:
    """One method for each topic of the live graph, written to a bag at `now_ns`; without a bag, no effect.

    Only recorded messages are serialized.
    """

    _bag = TrialBag('', 'none')  # also for a subclass that handles the publications itself
    _trial_node = topics.NAVIGATION_TRIAL_NODE
    _goal = encoders.SentGoal(_trial_node, 0, 0)  # before the first
    _frames: Optional[LinkFrames] = None  # if the bag records /tf
    _frames_ns = 0  # when they were published last
    _imu: Optional[encoders.ImuEncoder] = None  # if there is an IMU
    _models: Optional[encoders.ModelStatesEncoder] = None  # if it records /gazebo/model_states
    _map_frame = _odom_frame = _base_frame = _laser = ''
    _joints, _scan_s, _tf_node = ('', ''), 0.0, ''

    def __init__(self, bag: Optional[TrialBag] = None, params: Optional[RobotParams] = None, nav: str = '') -> None:
        """Create the publications; a bag needs the parameters of the robot and `nav` of the trial."""
        if bag is None or params is None:
            return
        self._bag = bag
        self._trial_node = topics.SCRIPTED_DRIVE_NODE if nav == 'scripted' else topics.NAVIGATION_TRIAL_NODE
        self._map_frame, self._odom_frame = params.amcl.global_frame_id, params.odometry.odom_frame
        self._base_frame, self._tf_node = params.odometry.base_frame, topics.ODOM_NODE * params.odometry.publish_tf
        self._joints = params.encoder.left_joint, params.encoder.right_joint
        self._laser, self._scan_s = params.simulator.laser_link, 1.0 / params.simulator.lidar.rate
        if params.simulator.imu is not None:
            self._imu = encoders.ImuEncoder(params.simulator.imu)

    def trial(self, trial: Trial) -> None:
        """Publish /trial, first of all."""
        if trial.fusion != 'none':
            self._tf_node = topics.FUSION_NODE
        self._bag.publish(topics.TRIAL, self._trial_node, 0, encoders.encode_string, trial.model_dump_json())

    def begin(self, trial: Trial, simulator: Simulator, robot_file: Path) -> None:
        """Publish the static transforms on /tf_static, before time runs."""
        if trial.nav == 'scripted':
            start = trial.test.start.pose()  # without localization, odom is at the start of the robot
            self._transform(topics.TF_STATIC, self._trial_node, 0, start, 0, self._map_frame, self._odom_frame)
        if simulator.imu_frames:
            self._transform(topics.TF_STATIC, topics.SIMULATOR_NODE, 0, IDENTITY, 0, *simulator.imu_frames)
        if self._bag.wants(topics.MODEL_STATES):
            self._models = encoders.ModelStatesEncoder(simulator.world, simulator.robot_name)
        if self._bag.wants(topics.TF):
            self._frames = LinkFrames(display_urdf(RobotSource(robot_file), simulator.joint_states().names))

    def ending(self, now_ns: int, ending: Ending) -> None:
        """Publish /trial_result."""
        text = json.dumps({'outcome': ending.outcome.value, 'reason': ending.reason})
        self._bag.publish(topics.TRIAL_RESULT, self._trial_node, now_ns, encoders.encode_string, text)

    def map(self, grid: OccupancyGrid) -> None:
        """Publish /map and /map_metadata, before time runs."""
        self._bag.publish(topics.MAP, topics.MAP_NODE, 0, encoders.encode_map, grid, 0, self._map_frame)
        self._bag.publish(topics.MAP_METADATA, topics.MAP_NODE, 0, encoders.encode_map_metadata, grid, 0)

    def joint_states(self, joints: JointStates) -> None:
        """Publish /clock and /joint_states at each tick, and frames on /tf, the fixed ones once on /tf_static."""
        now_ns = joints.stamp_ns
        self._bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, encoders.encode_clock, now_ns)
        self._bag.publish(topics.JOINT_STATES, topics.SIMULATOR_NODE, now_ns, encoders.encode_joint_state, joints)
        if self._frames is not None and now_ns - self._frames_ns >= FRAMES_PERIOD_NS:
            node, fixed = topics.STATE_PUBLISHER_NODE, self._frames.fixed
            if self._frames_ns == 0:
                self._bag.publish(topics.TF_STATIC, node, now_ns, _encode_frames, fixed, now_ns)
            self._frames_ns = now_ns
            self._bag.publish(topics.TF, node, now_ns, _encode_turned, self._frames, joints)

    @property
    def takes_imu(self) -> bool:
        """Return whether `imu` has an effect; otherwise samples may be skipped."""
        return self._imu is not None and self._bag.wants(topics.IMU)

    def imu(self, now_ns: int, sample: ImuSample) -> None:
        """Publish /imu/data."""
        if self._imu is not None:
            self._bag.publish(topics.IMU, topics.SIMULATOR_NODE, now_ns, self._imu.encode, sample)

    def models(self, now_ns: int, simulator: Simulator) -> None:
        """Publish /gazebo/model_states."""
        if self._models is not None:
            self._bag.publish(
                topics.MODEL_STATES, topics.SIMULATOR_NODE, now_ns, self._models.encode, simulator.physics.base()
            )

    def world_pose(self, now_ns: int, base_pose_in_map: Pose2D) -> None:
        """Publish /world_pose, the true pose."""
        self._pose(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, now_ns, base_pose_in_map)

    @property
    def takes_scans(self) -> bool:
        """Return whether `scan` has an effect; otherwise scans may be skipped."""
        return self._bag.wants(topics.SCAN)

    def scan(self, scan: Scan) -> None:
        """Publish /scan."""
        message = scan, self._laser, self._scan_s
        self._bag.publish(topics.SCAN, topics.SIMULATOR_NODE, scan.stamp_ns, encoders.encode_scan, *message)

    def encoder_pulse(self, now_ns: int, sample: EncoderSample) -> None:
        """Publish /encoder_pulse and, if speeds are measured, /encoder_velocity."""
        node, speeds_radps = topics.ENCODER_NODE, sample.wheel_rates_radps
        if speeds_radps is not None:
            speeds = sample.stamp_ns, speeds_radps, self._joints
            self._bag.publish(topics.ENCODER_VELOCITY, node, now_ns, encoders.encode_wheel_speeds, *speeds)
        self._bag.publish(topics.ENCODER_PULSE, node, now_ns, encoders.encode_encoder_pulse, sample, self._joints)

    def odometry(self, now_ns: int, estimate: OdometryEstimate, is_fused: bool = False) -> None:
        """Publish /odom or /odometry/filtered; that of navigation also as odom->base_link on /tf."""
        frames = self._odom_frame, self._base_frame
        topic, node = (topics.FILTERED, topics.FUSION_NODE) if is_fused else (topics.ODOM, topics.ODOM_NODE)
        if node == self._tf_node:
            self._transform(topics.TF, node, now_ns, estimate.base_pose_in_odom, estimate.stamp_ns, *frames)
        self._bag.publish(topic, node, now_ns, encoders.encode_odometry, estimate, *frames)

    def amcl_pose(self, now_ns: int, estimate: AmclEstimate) -> None:
        """Publish /amcl_pose."""
        message = estimate.base_pose_in_map, estimate.covariance, estimate.stamp_ns, self._map_frame
        self._bag.publish(topics.AMCL_POSE, topics.AMCL_NODE, now_ns, encoders.encode_pose_with_covariance, *message)

    def odom_in_map(self, now_ns: int, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        """Publish map->odom on /tf, with its stamp."""
        frames = self._map_frame, self._odom_frame
        self._transform(topics.TF, topics.AMCL_NODE, now_ns, odom_pose_in_map, stamp_ns, *frames)

    def global_pose(self, now_ns: int, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        """Publish /global_pose, the pose estimate."""
        self._pose(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, now_ns, stamp_ns, base_pose_in_map)

    def command(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        """Publish /cmd_vel, by the navigator or by the trial node."""
        node = topics.MOVE_BASE_NODE if is_navigators else self._trial_node
        self._bag.publish(topics.CMD_VEL, node, now_ns, encoders.encode_command, *command)

    def goal(self, now_ns: int, stamp_ns: int, goal_in_map: Pose2D) -> None:
        """Publish /move_base/goal; the stamp is that of the pose estimate at which it was sent."""
        self._goal = encoders.SentGoal(self._trial_node, self._goal.number + 1, now_ns)
        goal = self._goal, goal_in_map, stamp_ns, self._map_frame
        self._bag.publish(topics.GOAL, self._trial_node, now_ns, encoders.encode_goal, *goal)

    def goal_result(self, now_ns: int, status: GoalStatus, text: str) -> None:
        """Publish /move_base/result of the goal sent last."""
        result = self._goal, status, text, now_ns
        self._bag.publish(topics.RESULT, topics.MOVE_BASE_NODE, now_ns, encoders.encode_result, *result)

    def _pose(self, topic: str, node: str, now_ns: int, stamp_ns: int, pose_in_map: Pose2D) -> None:
        self._bag.publish(topic, node, now_ns, encoders.encode_pose_stamped, pose_in_map, stamp_ns, self._map_frame)

    def _transform(self, topic: str, node: str, now_ns: int, child: Pose2D, stamp_ns: int, *frames: str) -> None:
        """Publish a transform; `frames` are those of the parent and of the child."""
        self._bag.publish(topic, node, now_ns, encoders.encode_planar_tf, child, stamp_ns, *frames)
