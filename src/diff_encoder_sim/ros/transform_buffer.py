"""A buffer of transforms that no message on /tf can bring down."""

from __future__ import annotations

import copy

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from diff_encoder_sim.base.errors import InputFault, in_one_line
from diff_encoder_sim.base.stamps import check_stamp
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.node import log

USUAL_CACHE_S = 10.0  # tf2's own


class TransformBuffer(tf2_ros.Buffer):  # type: ignore[misc]  # tf2 has no types
    """Holds the transforms of /tf and /tf_static, without those that tf2 cannot take.

    tf2 aborts the whole process for a stamp near 2^32 s: such a one must not come to it.
    """

    def __init__(self, cache_s: float = USUAL_CACHE_S) -> None:
        """Subscribe to both topics; transforms are kept for `cache_s`."""
        super().__init__(rospy.Duration(cache_s))
        self._listener = tf2_ros.TransformListener(self, tcp_nodelay=True)

    def set_transform(self, transform: TransformStamped, authority: str) -> None:
        """Take a transform that `authority`, the name of a node, has published on /tf."""
        try:
            check_stamp(ns_from_stamp(transform.header.stamp), ns_from_stamp(rospy.Time.now()))
            super().set_transform(transform, authority)
        except (InputFault, ValueError, TypeError) as error:
            _warn('/tf', authority, transform, error)

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Take a transform of /tf_static. Its stamp means nothing, and must not be the newest of a frame that moves."""
        transform = copy.deepcopy(transform)
        transform.header.stamp = rospy.Time()
        try:
            super().set_transform_static(transform, authority)
        except (ValueError, TypeError) as error:
            _warn('/tf_static', authority, transform, error)


def _warn(topic: str, authority: str, transform: TransformStamped, error: Exception) -> None:
    log.warning(
        '%s: transform %r -> %r of %s: %s; dropped',
        topic,
        transform.header.frame_id,
        transform.child_frame_id,
        authority,
        in_one_line(error),
    )
