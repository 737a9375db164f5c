"""Nodes that publish poses and paths: global_pose_node, world_pose_node, ideal_odom_node, trial_view_node."""

from __future__ import annotations

import math
from typing import List, Optional

from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Vector3
from nav_msgs.msg import Odometry, Path
from pydantic import Field
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from diff_encoder_sim.base.bounds import Rate_Hz
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import encode_header, encode_pose, encode_pose_stamped, encode_sequence
from diff_encoder_sim.drives.test_definition import PoseParams
from diff_encoder_sim.robots.solids import Box, Cylinder, Sphere
from diff_encoder_sim.ros.gazebo_states import ModelStateReader, ModelStatesParams
from diff_encoder_sim.ros.messages import OdometryOutput, Publisher, header, ns_from_stamp, pose_subscriber
from diff_encoder_sim.ros.node import executable, log, node_params, required_trial_plan, trial_plan
from diff_encoder_sim.ros.transforms import NoTransform, TransformBuffer, lookup
from diff_encoder_sim.simulation.state import PlanarVelocity
from diff_encoder_sim.simulation.world import World, load_world
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.report_link import DEFAULT_RATE_HZ, BoundarySampler


class GlobalPoseParams(Params):
    """Parameters of global_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='poses per second of stamps [Hz]')


class GlobalPoseNode:
    """Publishes the transform map -> base_link as /global_pose, once per period if it is new."""

    def __init__(self) -> None:
        plan = trial_plan()
        defaults = {'rate': plan.report_rate} if plan else {}
        self._params = node_params(GlobalPoseParams, part='global_pose', defaults=defaults)
        self._restart()
        self._poses = Publisher('global_pose', PoseStamped)
        self._buffer = TransformBuffer()
        self._buffer.on_change = self._publish

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)

    def _publish(self) -> None:
        try:
            transform = lookup(self._buffer, self._params.map_frame, self._params.base_frame)
        except NoTransform as fault:
            log.info('no pose estimate: %s', fault)
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


class WorldPoseParams(ModelStatesParams):
    """Parameters of world_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    map_in_world: PoseParams = Field(PoseParams(), description='pose of the map frame in the world')


class WorldPoseNode:
    """Publishes the robot's true pose, from /gazebo/model_states, as /world_pose in the map frame."""

    def __init__(self) -> None:
        params = node_params(WorldPoseParams, part='world_pose')
        self._map_frame = params.map_frame
        self._world_in_map = params.map_in_world.pose().inverse()
        self._poses = Publisher('world_pose', PoseStamped)
        self._reader = ModelStateReader(params, self._on_state)

    def _on_state(self, stamp_ns: int, pose_in_world: Pose2D, _: PlanarVelocity) -> None:
        self._poses.publish(encode_pose_stamped(self._world_in_map.compose(pose_in_world), stamp_ns, self._map_frame))


class IdealOdomParams(ModelStatesParams):
    """Parameters of ideal_odom_node."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')


class IdealOdomNode:
    """Publishes error-free odometry from /gazebo/model_states: the true pose relative to the first one."""

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


MAP_FRAME = 'map'
POSES_PER_PATH_MESSAGE = 10  # each message contains the whole path; 2 Hz suffices for display
WALL_COLOUR = ColorRGBA(0.62, 0.66, 0.72, 1.0)


class PathTrail:
    """Collects poses relative to an origin in the map, and publishes them as a path in the map frame."""

    def __init__(self, path_topic: str, origin: Pose2D = IDENTITY) -> None:
        self._origin = origin
        self._poses: List[bytes] = []
        self._timeline = Timeline(tolerance_ns=0)
        self._paths = Publisher(path_topic, Path, latch=True)

    def add(self, stamp_ns: int, pose: Pose2D) -> None:
        """Add a pose; a jump back in time starts a new path."""
        step = self._timeline.advance(stamp_ns)
        if step is Step.RESTART:
            self._poses.clear()
        if step is Step.STALE:
            return
        self._poses.append(encode_pose_stamped(self._origin.compose(pose), stamp_ns, MAP_FRAME))
        if len(self._poses) % POSES_PER_PATH_MESSAGE == 0:
            self._paths.publish(encode_header(stamp_ns, MAP_FRAME) + encode_sequence(self._poses))


class TrialViewNode:
    """Publishes for RViz the world's walls as markers, and the paths of odometry, pose estimate and true pose."""

    def __init__(self) -> None:
        plan = required_trial_plan()
        Publisher('world_markers', MarkerArray, latch=True).publish(world_markers(load_world(plan.world), MAP_FRAME))
        trail = PathTrail('odom_path', plan.trial.test.start.pose())
        pose_subscriber(plan.trial.odometry_topic, trail.add, Odometry)
        pose_subscriber(topics.GLOBAL_POSE, PathTrail('global_pose_path').add)
        pose_subscriber(topics.WORLD_POSE, PathTrail('world_pose_path').add)


def world_markers(world: World, frame: str) -> MarkerArray:
    """Build RViz markers of walls and pillars, without the floor."""
    markers = []
    for index, solid in enumerate(world.solids):
        shape = solid.shape
        if isinstance(shape, Box):
            kind, scale = Marker.CUBE, shape.size_xyz_m
        elif isinstance(shape, Cylinder):
            kind, scale = Marker.CYLINDER, (2.0 * shape.radius_m, 2.0 * shape.radius_m, shape.length_m)
        elif isinstance(shape, Sphere):
            kind, scale = Marker.SPHERE, (2.0 * shape.radius_m,) * 3
        else:
            continue  # the floor
        place, yaw_rad = solid.pose_in_world, math.atan2(*solid.pose_in_world[1::-1, 0])
        pose = Pose(Point(*place[:3, 3].tolist()), Quaternion(*quat_xyzw_from_yaw(yaw_rad)))
        look = {'scale': Vector3(*scale), 'color': WALL_COLOUR}
        markers.append(Marker(header=header(0, frame), ns='world', id=index, type=kind, pose=pose, **look))
    return MarkerArray(markers)


global_pose_node = executable('global_pose_node', GlobalPoseNode)
world_pose_node = executable('world_pose_node', WorldPoseNode)
ideal_odom_node = executable('ideal_odom_node', IdealOdomNode)
trial_view_node = executable('trial_view_node', TrialViewNode)
