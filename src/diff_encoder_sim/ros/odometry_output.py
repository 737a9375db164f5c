"""Publishing odometry: on its topic and on TF."""

from __future__ import annotations

from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.drives.pose_messages import encode_odometry, encode_tf, encode_transform
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
from diff_encoder_sim.wheels.odometry import OdometryEstimate


class OdometryOutput:
    """Publishes estimates on `odom` and, with publish_tf, as the transform odom -> base."""

    def __init__(self, odom_frame: str, base_frame: str, publish_tf: bool) -> None:
        self._frames = odom_frame, base_frame
        self._odom = EncodedPublisher('odom', Odometry)
        self._transforms = EncodedPublisher('/tf', TFMessage) if publish_tf else None

    def publish(self, estimate: OdometryEstimate) -> None:
        """Publish one estimate, whose stamp the caller has not published before."""
        if self._transforms is not None:
            transform = encode_transform(estimate.base_pose_in_odom, estimate.stamp_ns, *self._frames)
            self._transforms.publish(encode_tf(transform))
        self._odom.publish(encode_odometry(estimate, *self._frames))
