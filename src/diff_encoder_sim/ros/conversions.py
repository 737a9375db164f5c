"""Conversions between types of the core and ROS messages that are not sent as encoded by `drives`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Pose, PoseStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from std_msgs.msg import Header

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.message_decoders import planar_pose
from diff_encoder_sim.drives.message_encoders import encode_map, encode_planar_pose, encode_pose_stamped

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid

PLANAR_AXES = (0, 1, 5)  # rows of x, y and yaw in a message's 6x6 covariance


def ns_from_stamp(stamp: rospy.Time) -> int:
    """Return nanoseconds since the epoch of the clock in use."""
    return int(stamp.to_nsec())


def stamp_from_ns(stamp_ns: int) -> rospy.Time:
    """Convert integer nanoseconds to ROS time."""
    return rospy.Time(*divmod(stamp_ns, 1_000_000_000))


def header(stamp_ns: int, frame: str) -> Header:
    """Return the header of a message."""
    return Header(stamp=stamp_from_ns(stamp_ns), frame_id=frame)


def pose_message(pose: Pose2D) -> Pose:
    """Convert a planar pose."""
    return Pose().deserialize(encode_planar_pose(pose))


def pose_stamped_message(pose: Pose2D, stamp_ns: int, frame: str) -> PoseStamped:
    """Convert a planar pose with stamp and frame."""
    return PoseStamped().deserialize(encode_pose_stamped(pose, stamp_ns, frame))


def map_message(grid: OccupancyGrid, stamp_ns: int, frame: str) -> OccupancyGridMessage:
    """Convert a grid, row by row from the origin."""
    return OccupancyGridMessage().deserialize(encode_map(grid, stamp_ns, frame))


def pose_from_message(pose: Pose) -> Pose2D:
    """Project a pose to the floor; InputFault if a number is not finite, or the quaternion is invalid."""
    return _pose_on_floor(pose.position, pose.orientation)


def pose_from_transform(transform: TransformStamped) -> Pose2D:
    """Convert a transform to the child's pose in the parent, projected to the floor."""
    return _pose_on_floor(transform.transform.translation, transform.transform.rotation)


def _pose_on_floor(position: Any, rotation: Any) -> Pose2D:
    return planar_pose(position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w)


def pose_covariance_from_message(covariance: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) covariance over (x, y, yaw) of a message's 36 numbers."""
    return np.array(covariance, dtype=float).reshape(6, 6)[np.ix_(PLANAR_AXES, PLANAR_AXES)]
