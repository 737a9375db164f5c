"""Conversions between the core's types and ROS messages: the only module that knows both."""

from __future__ import annotations

import math
from typing import Iterable, List, Sequence, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Twist,
    Vector3,
)
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw, yaw_from_quat_xyzw
from diff_encoder_sim.encoders.encoder_sample import EncoderSample
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Sphere
from diff_encoder_sim.serialization.message_types import UNKNOWN_VARIANCE
from diff_encoder_sim.simulation.state import BodyState, JointStates
from diff_encoder_sim.simulation.world import Plane, Solid, World

# Rows of x, y and yaw in a message's 6x6 covariance.
PLANAR_AXES = (0, 1, 5)

WALL_COLOUR = ColorRGBA(0.62, 0.66, 0.72, 1.0)


def ns_from_stamp(stamp: rospy.Time) -> int:
    """Return nanoseconds since the epoch of the clock in use."""
    return int(stamp.to_nsec())


def stamp_from_ns(stamp_ns: int) -> rospy.Time:
    """Convert a whole number of nanoseconds to ROS time."""
    return rospy.Time(*divmod(stamp_ns, 1_000_000_000))


def joint_state_message(joints: JointStates) -> JointState:
    """Convert wheel angles and speeds; efforts are left out."""
    message = JointState(name=list(joints.names), position=list(joints.angles_rad), velocity=list(joints.speeds_radps))
    message.header.stamp = stamp_from_ns(joints.stamp_ns)
    return message


def scan_message(scan: Scan, frame: str, period_s: float) -> LaserScan:
    """Convert a scan whose rays were all taken at its stamp; `period_s` is the time between scans."""
    count = len(scan.ranges_m)
    message = LaserScan(
        angle_min=scan.angle_min_rad,
        angle_max=scan.angle_min_rad + (count - 1) * scan.angle_increment_rad,
        angle_increment=scan.angle_increment_rad,
        time_increment=0.0,
        scan_time=period_s,
        range_min=scan.range_min_m,
        range_max=scan.range_max_m,
        ranges=scan.ranges_m.tolist(),
    )
    message.header.stamp = stamp_from_ns(scan.stamp_ns)
    message.header.frame_id = frame
    return message


def encoder_pulse_message(sample: EncoderSample, joints: Sequence[str]) -> EncoderPulse:
    """Convert both counters, left then right; `joints` are their names in that order."""
    message = EncoderPulse(name=list(joints), pulses=[sample.left_pulses, sample.right_pulses])
    message.header.stamp = stamp_from_ns(sample.stamp_ns)
    return message


def wheel_speeds_message(stamp_ns: int, speeds_radps: Sequence[float], joints: Sequence[str]) -> JointState:
    """Convert the wheels' speeds, left then right; `joints` are their names in that order."""
    message = JointState(name=list(joints), velocity=list(speeds_radps))
    message.header.stamp = stamp_from_ns(stamp_ns)
    return message


def wheel_speeds_from_message(message: JointState) -> Tuple[float, float]:
    """Return the speeds [rad/s] of a message with both wheels, left then right.

    Raises:
        InputFault: it has not exactly two, or one that is not finite.
    """
    if len(message.velocity) != 2 or not np.isfinite(message.velocity).all():
        raise InputFault(f'velocities {list(message.velocity)}; expected 2 finite numbers, left then right [rad/s]')
    left, right = message.velocity
    return left, right


def encoder_sample(message: EncoderPulse) -> EncoderSample:
    """Convert a message with both counters.

    Raises:
        InputFault: it has not exactly two counters.
    """
    if len(message.pulses) != 2:
        raise InputFault(f'{len(message.pulses)} counters; expected 2, left then right')
    return EncoderSample(ns_from_stamp(message.header.stamp), *message.pulses)


def odometry_message(estimate: OdometryEstimate, odom_frame: str, base_frame: str) -> Odometry:
    """Convert a pose in the odom frame and a twist in the base frame, each with its covariance."""
    message = Odometry(child_frame_id=base_frame)
    message.header.stamp = stamp_from_ns(estimate.stamp_ns)
    message.header.frame_id = odom_frame
    message.pose.pose = pose_message(estimate.base_pose_in_odom)
    message.pose.covariance = _planar_covariance(estimate.pose_covariance, PLANAR_AXES)
    message.twist.twist = Twist(
        Vector3(estimate.linear_velocity_mps, estimate.lateral_velocity_mps, 0),
        Vector3(0, 0, estimate.angular_velocity_radps),
    )
    message.twist.covariance = _planar_covariance(estimate.twist_covariance, (0, 5))
    return message


def transform_message(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> TransformStamped:
    """Convert a frame's pose in its parent to a transform."""
    message = TransformStamped(child_frame_id=child_frame)
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = parent_frame
    message.transform.translation = Vector3(child_pose.x_m, child_pose.y_m, 0.0)
    message.transform.rotation = Quaternion(*quat_xyzw_from_yaw(child_pose.yaw_rad))
    return message


def pose_stamped_message(pose: Pose2D, stamp_ns: int, frame: str) -> PoseStamped:
    """Convert a planar pose in a frame at a time."""
    message = PoseStamped(pose=pose_message(pose))
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = frame
    return message


def pose_message(pose: Pose2D) -> Pose:
    """Convert a planar pose."""
    return Pose(Point(pose.x_m, pose.y_m, 0.0), Quaternion(*quat_xyzw_from_yaw(pose.yaw_rad)))


def pose_from_message(pose: Pose) -> Pose2D:
    """Project a pose to the floor: height, roll and pitch are dropped.

    Raises:
        InputFault: a number is not finite, or the quaternion is no rotation.
    """
    position, orientation = pose.position, pose.orientation
    try:
        yaw_rad = yaw_from_quat_xyzw(orientation.x, orientation.y, orientation.z, orientation.w)
    except ValueError as error:
        raise InputFault(str(error)) from None
    if not np.isfinite((position.x, position.y)).all():
        raise InputFault(f'position ({position.x}, {position.y}); expected finite numbers [m]')
    return Pose2D(position.x, position.y, yaw_rad)


def pose_from_transform(transform: TransformStamped) -> Pose2D:
    """Convert a transform to the child's pose in the parent, projected to the floor."""
    translation, rotation = transform.transform.translation, transform.transform.rotation
    return pose_from_message(Pose(Point(translation.x, translation.y, translation.z), rotation))


def pose_with_covariance_message(
    pose: Pose2D, covariance: np.ndarray, stamp_ns: int, frame: str
) -> PoseWithCovarianceStamped:
    """Convert a planar pose with its 3x3 covariance over (x, y, yaw); the other variances are 0, as amcl's are."""
    message = PoseWithCovarianceStamped()
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = frame
    message.pose.pose = pose_message(pose)
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR_AXES, PLANAR_AXES)] = covariance
    message.pose.covariance = full.ravel().tolist()
    return message


def pose_covariance_from_message(covariance: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) covariance over (x, y, yaw) of a message's 36 numbers."""
    return np.array(covariance, dtype=float).reshape(6, 6)[np.ix_(PLANAR_AXES, PLANAR_AXES)]


def scan_from_message(message: LaserScan) -> Scan:
    """Convert a scan."""
    return Scan(
        ns_from_stamp(message.header.stamp),
        message.angle_min,
        message.angle_increment,
        message.range_min,
        message.range_max,
        np.array(message.ranges, dtype=float),
    )


def twist_std_from_message(message: Odometry) -> Tuple[float, float]:
    """Return the standard deviations of odometry's twist, linear [m/s] and angular [rad/s].

    A negative variance, which some drivers publish for an unknown one, counts as 0.
    """
    variances = message.twist.covariance[0], message.twist.covariance[35]
    return math.sqrt(max(variances[0], 0.0)), math.sqrt(max(variances[1], 0.0))


def body_messages(state: BodyState) -> Tuple[Pose, Twist]:
    """Convert a body's pose and twist in the world frame, as Gazebo reports them."""
    return (
        Pose(Point(*state.position_xyz_m), Quaternion(*state.quat_xyzw)),
        Twist(Vector3(*state.linear_xyz_mps), Vector3(*state.angular_xyz_radps)),
    )


def matrix_pose_message(pose: np.ndarray) -> Pose:
    """Convert a 4x4 pose without roll and pitch, as models on a floor have."""
    yaw_rad = float(np.arctan2(pose[1, 0], pose[0, 0]))
    return Pose(Point(*pose[:3, 3].tolist()), Quaternion(*quat_xyzw_from_yaw(yaw_rad)))


def world_markers(world: World, frame: str) -> MarkerArray:
    """Make markers of the world's walls and pillars for RViz, whose grid shows the floor."""
    return MarkerArray(
        [_marker(solid, index, frame) for index, solid in enumerate(world.solids) if not isinstance(solid.shape, Plane)]
    )


def _marker(solid: Solid, index: int, frame: str) -> Marker:
    marker = Marker(ns='world', id=index, action=Marker.ADD, color=WALL_COLOUR)
    marker.header.frame_id = frame
    marker.pose = matrix_pose_message(solid.pose_in_world)
    shape = solid.shape
    if isinstance(shape, Box):
        marker.type, marker.scale = Marker.CUBE, Vector3(*shape.size_xyz_m)
    elif isinstance(shape, Cylinder):
        diameter_m = 2.0 * shape.radius_m
        marker.type = Marker.CYLINDER
        marker.scale = Vector3(diameter_m, diameter_m, shape.length_m)
    elif isinstance(shape, Sphere):
        marker.type, marker.scale = Marker.SPHERE, Vector3(*[2.0 * shape.radius_m] * 3)
    return marker


def _planar_covariance(covariance: np.ndarray, axes: Iterable[int]) -> List[float]:
    """Return a 6x6 covariance, row by row, known only in `axes` of (x, y, z, roll, pitch, yaw)."""
    full = np.diag(np.full(6, UNKNOWN_VARIANCE))
    full[np.ix_(list(axes), list(axes))] = covariance
    return list(full.ravel())
