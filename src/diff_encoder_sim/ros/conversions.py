"""Conversions between types of the core and ROS messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Sequence, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion, TransformStamped, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw, yaw_from_quat_xyzw
from diff_encoder_sim.drives.message_encoders import QuatXyzw

if TYPE_CHECKING:
    from diff_encoder_sim.base.laser_scan import Scan
    from diff_encoder_sim.simulation.world import World

PLANAR_AXES = (0, 1, 5)  # rows of x, y and yaw in a message's 6x6 covariance
WALL_COLOUR = ColorRGBA(0.62, 0.66, 0.72, 1.0)


def ns_from_stamp(stamp: rospy.Time) -> int:
    """Return nanoseconds since the epoch of the clock in use."""
    return int(stamp.to_nsec())


def stamp_from_ns(stamp_ns: int) -> rospy.Time:
    """Convert integer nanoseconds to ROS time."""
    return rospy.Time(*divmod(stamp_ns, 1_000_000_000))


def header(stamp_ns: int, frame: str) -> Header:
    """Return the header of a message."""
    return Header(stamp=stamp_from_ns(stamp_ns), frame_id=frame)


def transform_message(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> TransformStamped:
    """Convert a frame's pose in its parent to a transform."""
    message = TransformStamped(header=header(stamp_ns, parent_frame), child_frame_id=child_frame)
    message.transform.translation = Vector3(child_pose.x_m, child_pose.y_m, 0.0)
    message.transform.rotation = Quaternion(*quat_xyzw_from_yaw(child_pose.yaw_rad))
    return message


def pose_stamped_message(pose: Pose2D, stamp_ns: int, frame: str) -> PoseStamped:
    """Convert a planar pose with stamp and frame."""
    return PoseStamped(header(stamp_ns, frame), pose_message(pose))


def pose_message(pose: Pose2D) -> Pose:
    """Convert a planar pose."""
    return Pose(Point(pose.x_m, pose.y_m, 0.0), Quaternion(*quat_xyzw_from_yaw(pose.yaw_rad)))


def pose_from_message(pose: Pose) -> Pose2D:
    """Project a pose to the floor; InputFault if a number is not finite, or the quaternion is invalid."""
    position, orientation = pose.position, pose.orientation
    return planar_pose(position.x, position.y, (orientation.x, orientation.y, orientation.z, orientation.w))


def planar_pose(x_m: float, y_m: float, quat_xyzw: QuatXyzw) -> Pose2D:
    """Project a pose to the floor, as `pose_from_message` does."""
    try:
        yaw_rad = yaw_from_quat_xyzw(*quat_xyzw)
    except ValueError as error:
        raise InputFault(str(error)) from None
    if not (math.isfinite(x_m) and math.isfinite(y_m)):
        raise InputFault(f'position ({x_m}, {y_m}); expected finite numbers [m]')
    return Pose2D(x_m, y_m, yaw_rad)


def pose_from_transform(transform: TransformStamped) -> Pose2D:
    """Convert a transform to the child's pose in the parent, projected to the floor."""
    translation, rotation = transform.transform.translation, transform.transform.rotation
    return pose_from_message(Pose(Point(translation.x, translation.y, translation.z), rotation))


def pose_with_covariance_message(
    pose: Pose2D, covariance: np.ndarray, stamp_ns: int, frame: str
) -> PoseWithCovarianceStamped:
    """Convert a planar pose with its 3x3 covariance over (x, y, yaw); other entries are 0, as in amcl."""
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR_AXES, PLANAR_AXES)] = covariance
    message = PoseWithCovarianceStamped(header=header(stamp_ns, frame))
    message.pose.pose, message.pose.covariance = pose_message(pose), full.ravel().tolist()
    return message


def pose_covariance_from_message(covariance: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) covariance over (x, y, yaw) of a message's 36 numbers."""
    return np.array(covariance, dtype=float).reshape(6, 6)[np.ix_(PLANAR_AXES, PLANAR_AXES)]


def scan_from_message(message: LaserScan) -> Scan:
    """Convert a scan."""
    from diff_encoder_sim.base.laser_scan import Scan  # noqa: PLC0415  # every node imports this module

    numbers = message.angle_min, message.angle_increment, message.range_min, message.range_max
    return Scan(ns_from_stamp(message.header.stamp), *numbers, np.array(message.ranges, dtype=float))


def twist_std_from_message(message: Odometry) -> Tuple[float, float]:
    """Return the standard deviations of a twist [m/s, rad/s]; negative variances, used for unknown ones, become 0."""
    linear, angular = (math.sqrt(max(message.twist.covariance[index], 0.0)) for index in (0, 35))
    return linear, angular


def world_markers(world: World, frame: str) -> MarkerArray:
    """Build RViz markers of walls and pillars, without the floor."""
    from diff_encoder_sim.robots.solids import Box, Cylinder, Sphere  # noqa: PLC0415  # every node imports this module

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
