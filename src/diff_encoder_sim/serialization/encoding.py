"""Serialised ROS messages of the core's values, made without ROS.

Byte for byte what the nodes publish (ros/conversions.py and its neighbours), but for the seq of
a header, which is 0 here: the publisher counts it. What comes 20 times a second or more is packed
by hand, in a fraction of the time that rosbags takes (test/benchmark/recording.py); the rest is
rosbags' work.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Tuple

import numpy as np
from rosbags.typesys.stores.ros1_noetic import actionlib_msgs__msg__GoalID as GoalID
from rosbags.typesys.stores.ros1_noetic import actionlib_msgs__msg__GoalStatus as GoalStatusMessage
from rosbags.typesys.stores.ros1_noetic import builtin_interfaces__msg__Time as Time
from rosbags.typesys.stores.ros1_noetic import geometry_msgs__msg__Point as Point
from rosbags.typesys.stores.ros1_noetic import geometry_msgs__msg__Pose as Pose
from rosbags.typesys.stores.ros1_noetic import geometry_msgs__msg__PoseStamped as PoseStamped
from rosbags.typesys.stores.ros1_noetic import geometry_msgs__msg__PoseWithCovariance as PoseWithCovariance
from rosbags.typesys.stores.ros1_noetic import (
    geometry_msgs__msg__PoseWithCovarianceStamped as PoseWithCovarianceStamped,
)
from rosbags.typesys.stores.ros1_noetic import geometry_msgs__msg__Quaternion as Quaternion
from rosbags.typesys.stores.ros1_noetic import nav_msgs__msg__MapMetaData as MapMetaData
from rosbags.typesys.stores.ros1_noetic import nav_msgs__msg__OccupancyGrid as OccupancyGridMessage
from rosbags.typesys.stores.ros1_noetic import sensor_msgs__msg__LaserScan as LaserScan
from rosbags.typesys.stores.ros1_noetic import std_msgs__msg__Header as Header
from rosbags.typesys.stores.ros1_noetic import std_msgs__msg__String as String

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.encoders.wheel_encoder import EncoderSample
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.goal_status import GoalStatus
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.serialization.message_types import (
    MOVE_BASE_ACTION_GOAL,
    MOVE_BASE_ACTION_RESULT,
    MOVE_BASE_GOAL,
    MOVE_BASE_RESULT,
    UNKNOWN_VARIANCE,
)
from diff_encoder_sim.serialization.primitives import (
    QuatXyzw,
    Vector,
    packed_header,
    packed_numbers,
    packed_pose,
    packed_sequence,
    packed_text,
    packed_texts,
    packed_time,
    packed_twist,
)
from diff_encoder_sim.serialization.typestore import STORE
from diff_encoder_sim.simulation.state import BodyState, JointStates
from diff_encoder_sim.simulation.world import World

# actionlib_msgs/GoalStatus of a goal that is over.
_ACTION_STATUS = {
    GoalStatus.PREEMPTED: GoalStatusMessage.PREEMPTED,
    GoalStatus.SUCCEEDED: GoalStatusMessage.SUCCEEDED,
    GoalStatus.ABORTED: GoalStatusMessage.ABORTED,
}

_MoveBaseGoal = STORE.types[MOVE_BASE_GOAL]
_MoveBaseResult = STORE.types[MOVE_BASE_RESULT]
_MoveBaseActionGoal = STORE.types[MOVE_BASE_ACTION_GOAL]
_MoveBaseActionResult = STORE.types[MOVE_BASE_ACTION_RESULT]


class SentGoal(NamedTuple):
    """What tells a goal of an action from others: actionlib_msgs/GoalID."""

    node: str  # that sent it
    number: int  # of its goals, from 1
    stamp_ns: int  # when it was sent


# ---- packed by hand


def clock_message(stamp_ns: int) -> bytes:
    """rosgraph_msgs/Clock."""
    return packed_time(stamp_ns)


def joint_state_message(joints: JointStates) -> bytes:
    """sensor_msgs/JointState: wheel angles and speeds; efforts are left out."""
    return b''.join(
        (
            packed_header(joints.stamp_ns, ''),
            packed_texts(joints.names),
            packed_numbers('d', joints.angles_rad),
            packed_numbers('d', joints.speeds_radps),
            packed_numbers('d', ()),
        )
    )


def twist_message(linear_mps: float, angular_radps: float) -> bytes:
    """geometry_msgs/Twist of a velocity command."""
    return packed_twist((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def encoder_pulse_message(sample: EncoderSample, joints: Tuple[str, str]) -> bytes:
    """diff_encoder_sim/EncoderPulse, left then right; `joints` are their names in that order."""
    return b''.join(
        (
            packed_header(sample.stamp_ns, ''),
            packed_texts(joints),
            packed_numbers('q', (sample.left_pulses, sample.right_pulses)),
        )
    )


def odometry_message(estimate: OdometryEstimate, odom_frame: str, base_frame: str) -> bytes:
    """nav_msgs/Odometry: pose in the odom frame, twist in the base frame, with covariances."""
    pose_covariance = _covariance(estimate.pose_covariance, _POSE_CELLS, _ALL_UNKNOWN)
    twist_covariance = _covariance(estimate.twist_covariance, _TWIST_CELLS, _ALL_UNKNOWN)
    return b''.join(
        (
            packed_header(estimate.stamp_ns, odom_frame),
            packed_text(base_frame),
            _packed_planar_pose(estimate.base_pose_in_odom),
            pose_covariance.tobytes(),
            twist_message(estimate.linear_velocity_mps, estimate.angular_velocity_radps),
            twist_covariance.tobytes(),
        )
    )


def pose_stamped_message(pose: Pose2D, stamp_ns: int, frame: str) -> bytes:
    """geometry_msgs/PoseStamped of a planar pose."""
    return packed_header(stamp_ns, frame) + _packed_planar_pose(pose)


def transform(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """geometry_msgs/TransformStamped of a frame's planar pose in its parent."""
    return packed_header(stamp_ns, parent_frame) + packed_text(child_frame) + _packed_planar_pose(child_pose)


def spatial_transform(
    translation_xyz_m: Vector, quat_xyzw: QuatXyzw, stamp_ns: int, parent_frame: str, child_frame: str
) -> bytes:
    """geometry_msgs/TransformStamped of a frame's pose in its parent."""
    return packed_header(stamp_ns, parent_frame) + packed_text(child_frame) + packed_pose(translation_xyz_m, quat_xyzw)


def tf_message(*transforms: bytes) -> bytes:
    """tf2_msgs/TFMessage of what `transform` and `spatial_transform` return."""
    return packed_sequence(transforms)


class ModelStatesMessages:
    """gazebo_msgs/ModelStates of a world in which the robot alone moves; it comes last."""

    def __init__(self, world: World, robot_name: str) -> None:
        self._names = packed_texts((*(model.name for model in world.models), robot_name))
        self._poses = [_packed_upright_pose(model.pose_in_world) for model in world.models]
        self._twists = [packed_twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * len(self._poses)

    def message(self, robot: BodyState) -> bytes:
        """With the robot's pose and twist in the world frame."""
        pose = packed_pose(robot.position_xyz_m, robot.quat_xyzw)
        twist = packed_twist(robot.linear_xyz_mps, robot.angular_xyz_radps)
        return self._names + packed_sequence([*self._poses, pose]) + packed_sequence([*self._twists, twist])


# ---- by rosbags


def text_message(text: str) -> bytes:
    """std_msgs/String."""
    return _serialised(String(text))


def scan_message(scan: Scan, frame: str, period_s: float) -> bytes:
    """sensor_msgs/LaserScan whose rays were all taken at its stamp, one sweep each `period_s`."""
    angle_max_rad = scan.angle_min_rad + (len(scan.ranges_m) - 1) * scan.angle_increment_rad
    return _serialised(
        LaserScan(
            _header(scan.stamp_ns, frame),
            scan.angle_min_rad,
            angle_max_rad,
            scan.angle_increment_rad,
            0.0,
            period_s,
            scan.range_min_m,
            scan.range_max_m,
            scan.ranges_m.astype(np.float32),
            np.empty(0, np.float32),
        )
    )


def pose_with_covariance_message(pose: Pose2D, covariance: np.ndarray, stamp_ns: int, frame: str) -> bytes:
    """geometry_msgs/PoseWithCovarianceStamped; `covariance` is 3x3 over (x, y, yaw)."""
    return _serialised(
        PoseWithCovarianceStamped(
            _header(stamp_ns, frame),
            PoseWithCovariance(_planar_pose(pose), _covariance(covariance, _POSE_CELLS, _ALL_ZERO)),
        )
    )


def map_message(grid: OccupancyGrid, stamp_ns: int, frame: str) -> bytes:
    """nav_msgs/OccupancyGrid, row by row from the origin."""
    return _serialised(OccupancyGridMessage(_header(stamp_ns, frame), _map_info(grid, stamp_ns), grid.cells.ravel()))


def map_metadata_message(grid: OccupancyGrid, stamp_ns: int) -> bytes:
    """nav_msgs/MapMetaData."""
    return _serialised(_map_info(grid, stamp_ns))


def goal_message(sent: SentGoal, goal_in_map: Pose2D, goal_stamp_ns: int, map_frame: str) -> bytes:
    """move_base_msgs/MoveBaseActionGoal; `goal_stamp_ns` is of the pose, not of the sending."""
    target = _MoveBaseGoal(_pose_stamped(goal_in_map, goal_stamp_ns, map_frame))
    return _serialised(_MoveBaseActionGoal(_header(sent.stamp_ns, ''), _goal_id(sent), target))


def result_message(sent: SentGoal, status: GoalStatus, text: str, stamp_ns: int) -> bytes:
    """move_base_msgs/MoveBaseActionResult of a goal that is over."""
    return _serialised(
        _MoveBaseActionResult(
            _header(stamp_ns, ''), GoalStatusMessage(_goal_id(sent), _ACTION_STATUS[status], text), _MoveBaseResult()
        )
    )


def _serialised(message: Any) -> bytes:
    return bytes(STORE.serialize_ros1(message, message.__msgtype__))


def _time(stamp_ns: int) -> Time:
    return Time(*divmod(stamp_ns, NANOSECONDS_PER_SECOND))


def _header(stamp_ns: int, frame: str) -> Header:
    return Header(0, _time(stamp_ns), frame)


def _goal_id(sent: SentGoal) -> GoalID:
    """As actionlib's Python client makes it."""
    stamp_s = sent.stamp_ns / NANOSECONDS_PER_SECOND
    return GoalID(_time(sent.stamp_ns), f'{sent.node}-{sent.number}-{stamp_s:.3f}')


def _planar_pose(pose: Pose2D) -> Pose:
    return Pose(Point(pose.x_m, pose.y_m, 0.0), Quaternion(*quat_xyzw_from_yaw(pose.yaw_rad)))


def _pose_stamped(pose: Pose2D, stamp_ns: int, frame: str) -> PoseStamped:
    return PoseStamped(_header(stamp_ns, frame), _planar_pose(pose))


def _map_info(grid: OccupancyGrid, stamp_ns: int) -> MapMetaData:
    return MapMetaData(_time(stamp_ns), grid.resolution_m, grid.width, grid.height, _planar_pose(grid.origin))


def _packed_planar_pose(pose: Pose2D) -> bytes:
    return packed_pose((pose.x_m, pose.y_m, 0.0), quat_xyzw_from_yaw(pose.yaw_rad))


def _packed_upright_pose(pose: np.ndarray) -> bytes:
    """Of a 4x4 pose, as models on a floor have it."""
    yaw_rad = float(np.arctan2(pose[1, 0], pose[0, 0]))
    return packed_pose(tuple(pose[:3, 3].tolist()), quat_xyzw_from_yaw(yaw_rad))


def _cells(*axes: int) -> np.ndarray:
    """Where some of (x, y, z, roll, pitch, yaw) stand in a 6x6 matrix, row by row."""
    return np.ravel_multi_index(np.ix_(axes, axes), (6, 6)).ravel()


_POSE_CELLS, _TWIST_CELLS = _cells(0, 1, 5), _cells(0, 5)
_ALL_UNKNOWN = np.diag(np.full(6, UNKNOWN_VARIANCE)).ravel().astype('<f8')
_ALL_ZERO = np.zeros(36, '<f8')


def _covariance(planar: np.ndarray, cells: np.ndarray, elsewhere: np.ndarray) -> np.ndarray:
    full = elsewhere.copy()
    full[cells] = np.ravel(planar)
    return full
