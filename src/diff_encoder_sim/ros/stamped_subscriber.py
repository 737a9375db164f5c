"""Subscribing to messages with a header, without those whose stamp cannot be."""

from __future__ import annotations

from typing import Any, Callable, Type

import genpy
import rospy

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import MOST_AHEAD_S, check_stamp
from diff_encoder_sim.ros.clock_pauses import wait_for_clock
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.node import log, subscriber


def stamped_subscriber(
    topic: str, message_class: Type[genpy.Message], callback: Callable[[Any], None], most_ahead_s: float = MOST_AHEAD_S
) -> rospy.Subscriber:
    """Subscribe as `subscriber` does; a message whose stamp cannot be is dropped with a warning."""
    resolved_name = rospy.resolve_name(topic)

    def on_message(message: Any) -> None:
        try:
            check_stamp_now(ns_from_stamp(message.header.stamp), most_ahead_s)
        except InputFault as fault:
            log.warning('%s: message dropped: %s', resolved_name, fault)
            return
        callback(message)

    return subscriber(topic, message_class, on_message)


def check_stamp_now(stamp_ns: int, most_ahead_s: float = MOST_AHEAD_S) -> None:
    """Check that a stamp can be at this time, as `check_stamp` does; raise InputFault."""
    try:
        check_stamp(stamp_ns, ns_from_stamp(rospy.Time.now()), most_ahead_s)
    except InputFault:
        # Far ahead of the newest tick that was read: at sixty times real time a pause is a second.
        wait_for_clock()
        check_stamp(stamp_ns, ns_from_stamp(rospy.Time.now()), most_ahead_s)
