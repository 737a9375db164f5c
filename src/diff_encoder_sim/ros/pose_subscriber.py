"""Subscribing to a stamped pose, projected to the floor."""

from __future__ import annotations

from typing import Callable

import rospy
from geometry_msgs.msg import PoseStamped

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.message_types import POSE_STAMPED
from diff_encoder_sim.drives.pose_messages import PoseDecoder
from diff_encoder_sim.ros.encoded_topics import encoded_stamped_subscriber


def pose_subscriber(topic: str, callback: Callable[[int, Pose2D], None]) -> rospy.Subscriber:
    """Call back with (stamp_ns, pose in the message's frame); an invalid pose is dropped with a warning."""
    decoder = PoseDecoder(POSE_STAMPED)

    def take(content: bytes) -> None:
        stamped = decoder.decode(content)
        callback(stamped.stamp_ns, stamped.pose)

    return encoded_stamped_subscriber(topic, PoseStamped, take)
