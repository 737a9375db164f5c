"""Publishing odometry: on its topic and on TF."""

from __future__ import annotations

from typing import Optional

import tf2_ros
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.ros.conversions import odometry_message, transform_message
from diff_encoder_sim.ros.node import publisher


class OdometryOutput:
    """Publishes estimates on `odom` and, with publish_tf, as the transform odom -> base."""

    def __init__(self, odom_frame: str, base_frame: str, publish_tf: bool) -> None:
        self._odom_frame = odom_frame
        self._base_frame = base_frame
        self._odom = publisher('odom', Odometry)
        self._broadcaster: Optional[tf2_ros.TransformBroadcaster] = None
        if publish_tf:
            # Shares its connections with the broadcaster, whose own would delay messages (no TCP_NODELAY).
            self._undelayed = publisher('/tf', TFMessage)
            self._broadcaster = tf2_ros.TransformBroadcaster()

    def publish(self, estimate: OdometryEstimate) -> None:
        """Publish one estimate, whose stamp the caller has not published before."""
        if self._broadcaster is not None:
            self._broadcaster.sendTransform(
                transform_message(estimate.base_pose_in_odom, estimate.stamp_ns, self._odom_frame, self._base_frame)
            )
        self._odom.publish(odometry_message(estimate, self._odom_frame, self._base_frame))
