"""Initial poses that users publish or send: read, checked, and moved by odometry from their stamp to now."""

from __future__ import annotations

from typing import Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import check_covariance, check_pose
from diff_encoder_sim.ros.conversions import pose_covariance_from_message, pose_from_message, pose_from_transform
from diff_encoder_sim.ros.node import log

# A base pose in the map with its 3x3 covariance over (x [m], y [m], yaw [rad]).
PoseGuess = Tuple[Pose2D, np.ndarray]


class InitialPoseReader:
    """Reads messages with a pose in the map; the frames are those of the parameters."""

    def __init__(self, params: AmclParams, buffer: tf2_ros.Buffer) -> None:
        self._global_frame = params.global_frame_id
        self._odom_to_base = params.odom_frame_id, params.base_frame_id
        self._buffer = buffer

    def read(self, message: PoseWithCovarianceStamped) -> PoseGuess:
        """Return the pose that a message gives, moved by odometry from the message's stamp to now.

        Raises:
            InputFault: it is no valid pose, or in another frame than the map's.
        """
        frame = message.header.frame_id.lstrip('/')
        if not frame:
            log.warning('initial pose: header.frame_id is empty; used as if it were %r', self._global_frame)
        elif frame != self._global_frame:
            raise InputFault(f'header.frame_id is {frame!r}; expected {self._global_frame!r}')
        pose = pose_from_message(message.pose.pose)
        covariance = pose_covariance_from_message(message.pose.covariance)
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        return pose.compose(self._moved_since(message.header.stamp)), covariance

    def _moved_since(self, stamp: rospy.Time) -> Pose2D:
        """Return the base's pose now in the base frame at a stamp, by odometry; a stamp of 0 means now."""
        try:
            now = self._buffer.lookup_transform(*self._odom_to_base, rospy.Time(0))
            if stamp.is_zero() or stamp >= now.header.stamp:
                return IDENTITY
            then = self._buffer.lookup_transform(*self._odom_to_base, stamp)
        except tf2_ros.TransformException as error:
            if not stamp.is_zero():
                log.warning('initial pose: not corrected for the motion since its stamp: %s', error)
            return IDENTITY
        return pose_from_transform(now).relative_to(pose_from_transform(then))
