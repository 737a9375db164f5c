"""Transforms that navigation looks up: of odom, the laser, and the frames of goals."""

from __future__ import annotations

from typing import Optional, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, TransformStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.navigator_inputs import MOST_AHEAD_S
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, pose_from_transform
from diff_encoder_sim.ros.scan_queue import ScannerMount, scanner_mount
from diff_encoder_sim.ros.transform_buffer import TransformBuffer

# Largest tilt of a goal's z axis, as 1 - cos of its angle: upstream's.
MOST_TILT = 1e-3


class NavigationTransforms:
    """Looks up the newest transforms between the frames of navigation; frame ids may begin with '/'."""

    def __init__(self, map_frame: str, odom_frame: str, base_frame: str) -> None:
        self.map_frame, self.odom_frame = map_frame.lstrip('/'), odom_frame.lstrip('/')
        self.base_frame = base_frame.lstrip('/')
        self._buffer = TransformBuffer()

    def odom_pose_in_map(self, now_ns: int) -> Optional[Tuple[int, Pose2D]]:
        """Return (stamp_ns, pose of odom in the map), None while there is no such transform.

        Raises:
            InputFault: the transform is no valid pose.
        """
        try:
            transform = self._buffer.lookup_transform(self.map_frame, self.odom_frame, rospy.Time(0))
        except tf2_ros.TransformException:
            return None
        # A static transform has no stamp.
        stamp_ns = ns_from_stamp(transform.header.stamp) or now_ns
        if stamp_ns - now_ns > MOST_AHEAD_S * NANOSECONDS_PER_SECOND:
            # From before time was reset: tf2 would keep it, and reject the new ones as too old.
            self._buffer.clear()
            return None
        return stamp_ns, pose_from_transform(transform)

    def check_odometry(self, frame: str) -> None:
        """Check that /odom is in the frame local_costmap/global_frame; a message without a frame is taken.

        Raises:
            InputFault: it is in another frame.
        """
        if frame.lstrip('/') not in ('', self.odom_frame):
            raise InputFault(f'header.frame_id is {frame!r}; expected {self.odom_frame!r} (local_costmap/global_frame)')

    def laser_mount(self, laser_frame: str) -> ScannerMount:
        """Look up how the laser with a scan's frame is mounted on the robot.

        Raises:
            InputFault: there is no such transform, or it is no valid pose.
        """
        return scanner_mount(self._lookup(self.base_frame, laser_frame))

    def pose_in_map(self, message: PoseStamped) -> Pose2D:
        """Transform a goal or a start to the map frame, by the newest transform, whatever its stamp.

        Raises:
            InputFault: it is no upright pose, or there is no transform from its frame.
        """
        pose = pose_from_message(message.pose)
        rotation = message.pose.orientation
        leaning = rotation.x**2 + rotation.y**2
        if 2.0 * leaning > MOST_TILT * (leaning + rotation.z**2 + rotation.w**2):
            raise InputFault('the z axis of the pose is not upright')
        if message.header.frame_id.lstrip('/') == self.map_frame:
            return pose  # also while there is no transform to the map
        frame_in_map = self._lookup(self.map_frame, message.header.frame_id)
        return pose_from_transform(frame_in_map).compose(pose)

    def _lookup(self, parent: str, child: str) -> TransformStamped:
        try:
            return self._buffer.lookup_transform(parent, child.lstrip('/'), rospy.Time(0))
        except tf2_ros.TransformException as error:
            reason = str(error).rstrip('. ')
            raise InputFault(f'no transform from frame {child!r} to {parent!r}: {reason}') from None
