"""Subscribing to a stamped pose, projected to the floor."""

from __future__ import annotations

from typing import Callable

import rospy
from geometry_msgs.msg import PoseStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message
from diff_encoder_sim.ros.node import log
from diff_encoder_sim.ros.stamped_subscriber import stamped_subscriber


def pose_subscriber(topic: str, callback: Callable[[int, Pose2D], None]) -> rospy.Subscriber:
    """Call back with (stamp_ns, pose in the message's frame); an invalid pose is dropped with a warning."""

    def on_message(message: PoseStamped) -> None:
        try:
            pose = pose_from_message(message.pose)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', topic, fault)
            return
        callback(ns_from_stamp(message.header.stamp), pose)

    return stamped_subscriber(topic, PoseStamped, on_message)
