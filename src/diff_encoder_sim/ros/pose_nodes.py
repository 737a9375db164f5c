"""Nodes that publish poses and paths: global_pose_node, world_pose_node, ideal_odom_node, trial_view_node."""

from __future__ import annotations

import math
import threading
from typing import Optional

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from pydantic import Field
from visualization_msgs.msg import MarkerArray

from diff_encoder_sim.base.bounds import Rate_Hz
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import encode_header, encode_pose, encode_pose_stamped
from diff_encoder_sim.drives.test_definition import PoseParams
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, pose_stamped_message, world_markers
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher, OdometryOutput, stamped_subscriber
from diff_encoder_sim.ros.gazebo_states import ModelStateReader, ModelStatesParams
from diff_encoder_sim.ros.node import log, node_params, publisher, required_trial_plan, run_node, trial_plan
from diff_encoder_sim.ros.transforms import TransformBuffer
from diff_encoder_sim.simulation.state import PlanarVelocity
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.report_link import DEFAULT_RATE_HZ, BoundarySampler


class GlobalPoseParams(Params):
    """Parameters of global_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='poses per second of stamps [Hz]')


class GlobalPoseNode:
    """Looks up map -> base_link after each transform, and publishes it once per period if it is new."""

    def __init__(self) -> None:
        plan = trial_plan()
        defaults = {'rate': plan.report_rate} if plan else {}
        self._params = node_params(GlobalPoseParams, part='global_pose', defaults=defaults)
        self._lock = threading.Lock()  # each publisher of /tf comes in a separate thread
        self._restart()
        self._poses = EncodedPublisher('global_pose', PoseStamped)
        self._buffer = TransformBuffer()
        self._buffer.listen(self._publish)

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)

    def _publish(self) -> None:
        with self._lock:
            frames = self._params.map_frame, self._params.base_frame
            try:
                transform = self._buffer.lookup_transform(*frames, rospy.Time(0))
            except tf2_ros.TransformException as error:
                log.info('no pose estimate: no transform %s -> %s (%s)', *frames, str(error).rstrip('. '))
                return
            stamp_ns = ns_from_stamp(transform.header.stamp)
            step = self._timeline.advance(stamp_ns)
            if step is Step.RESTART:
                self._restart()
            if step is Step.STALE or self._sampler.period_index(stamp_ns) is None:
                return
            position, rotation = transform.transform.translation, transform.transform.rotation
            pose = encode_pose((position.x, position.y, position.z), (rotation.x, rotation.y, rotation.z, rotation.w))
            self._poses.publish(encode_header(stamp_ns, transform.header.frame_id) + pose)


def global_pose_node() -> None:
    """global_pose_node: publishes the transform map -> base_link as /global_pose at a fixed rate."""
    run_node('global_pose_node', GlobalPoseNode)


class WorldPoseParams(ModelStatesParams):
    """Parameters of world_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    map_in_world: PoseParams = Field(PoseParams(), description='pose of the map frame in the world')


class WorldPoseNode:
    """Republishes one model's pose in the map frame."""

    def __init__(self) -> None:
        params = node_params(WorldPoseParams, part='world_pose')
        self._map_frame = params.map_frame
        self._world_in_map = params.map_in_world.pose().inverse()
        self._poses = EncodedPublisher('world_pose', PoseStamped)
        self._reader = ModelStateReader(params, self._on_state)

    def _on_state(self, stamp_ns: int, pose_in_world: Pose2D, _: PlanarVelocity) -> None:
        self._poses.publish(encode_pose_stamped(self._world_in_map.compose(pose_in_world), stamp_ns, self._map_frame))


def world_pose_node() -> None:
    """world_pose_node: publishes the robot's true pose, from /gazebo/model_states, as /world_pose in the map frame."""
    run_node('world_pose_node', WorldPoseNode)


class IdealOdomParams(ModelStatesParams):
    """Parameters of ideal_odom_node."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')


class IdealOdomNode:
    """Publishes the true pose, relative to the first one, on /odom and TF."""

    def __init__(self) -> None:
        params = node_params(IdealOdomParams, part='ideal_odom')
        self._start_pose: Optional[Pose2D] = None
        self._newest_ns = 0
        self._output = OdometryOutput(params.odom_frame, params.base_frame, params.publish_tf)
        self._reader = ModelStateReader(params, self._on_state)

    def _on_state(self, stamp_ns: int, pose_in_world: Pose2D, velocity: PlanarVelocity) -> None:
        if self._start_pose is None or stamp_ns < self._newest_ns:
            self._start_pose = pose_in_world
        self._newest_ns = stamp_ns
        yaw_rad = pose_in_world.yaw_rad
        forward_mps = velocity.x_mps * math.cos(yaw_rad) + velocity.y_mps * math.sin(yaw_rad)
        pose = pose_in_world.relative_to(self._start_pose)
        self._output.publish(OdometryEstimate(stamp_ns, pose, forward_mps, velocity.yaw_radps))


def ideal_odom_node() -> None:
    """ideal_odom_node: publishes error-free odometry from /gazebo/model_states."""
    run_node('ideal_odom_node', IdealOdomNode)


MAP_FRAME = 'map'
POSES_PER_PATH_MESSAGE = 10  # each message contains the whole path; 2 Hz suffices for display


class PathTrail:
    """Collects poses in the map frame and publishes them as a path."""

    def __init__(self, path_topic: str) -> None:
        self._path = Path()
        self._timeline = Timeline(tolerance_ns=0)
        self._paths = publisher(path_topic, Path, latch=True)

    def add(self, message: PoseStamped) -> None:
        """Add a pose; a jump back in time starts a new path."""
        step = self._timeline.advance(ns_from_stamp(message.header.stamp))
        if step is Step.RESTART:
            self._path.poses = []
        if step is Step.STALE:
            return
        self._path.header = message.header
        self._path.poses.append(message)
        if len(self._path.poses) % POSES_PER_PATH_MESSAGE == 0:
            self._paths.publish(self._path)


class TrialViewNode:
    """Publishes the world's walls as markers, and the paths of odometry, pose estimate and true pose."""

    def __init__(self) -> None:
        plan = required_trial_plan()
        self._start = plan.trial.test.start.pose()
        self._markers = publisher('world_markers', MarkerArray, latch=True)
        self._markers.publish(world_markers(load_world(plan.world), MAP_FRAME))
        self._odom_trail = PathTrail('odom_path')
        self._subscribers = [
            stamped_subscriber(topics.ODOM, Odometry, self._on_odom),
            stamped_subscriber(topics.GLOBAL_POSE, PoseStamped, PathTrail('global_pose_path').add),
            stamped_subscriber(topics.WORLD_POSE, PoseStamped, PathTrail('world_pose_path').add),
        ]

    def _on_odom(self, message: Odometry) -> None:
        """Add the pose of odometry, relative to the known start."""
        pose = self._start.compose(pose_from_message(message.pose.pose))
        self._odom_trail.add(pose_stamped_message(pose, ns_from_stamp(message.header.stamp), MAP_FRAME))


def trial_view_node() -> None:
    """trial_view_node: publishes the world and paths for RViz."""
    run_node('trial_view_node', TrialViewNode)
