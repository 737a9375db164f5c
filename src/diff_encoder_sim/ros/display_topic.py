"""Topics for displays: published at a low rate, and only to subscribers."""

from __future__ import annotations

from typing import Optional, Type

import genpy
import rospy


class DisplayTopic:
    """A topic that drops messages rather than wait for a slow display: the robot must not wait.

    Args:
        topic: its name.
        message_class: its type.
        queue_size: messages that may wait for a slow display; a newer one replaces the oldest.
    """

    def __init__(self, topic: str, message_class: Type[genpy.Message], queue_size: int = 1) -> None:
        self._newcomers = _Newcomers()
        self._publisher = rospy.Publisher(
            topic, message_class, subscriber_listener=self._newcomers, queue_size=queue_size
        )
        self._due_ns: Optional[int] = None  # when it was last

    @property
    def has_subscribers(self) -> bool:
        """Return whether anybody would see a message."""
        return bool(self._publisher.get_num_connections())

    def is_due(self, period_ns: float, now_ns: int) -> bool:
        """Return whether there is a subscriber, and a period is over since it was last due, or time has jumped back."""
        is_over = self._due_ns is None or not 0 <= now_ns - self._due_ns < period_ns
        if not (is_over and self.has_subscribers):
            return False
        self._due_ns = now_ns
        return True

    def take_newcomers(self) -> bool:
        """Return whether somebody has subscribed since the last call."""
        are_there, self._newcomers.are_there = self._newcomers.are_there, False
        return are_there

    def publish(self, message: genpy.Message) -> None:
        """Publish a message."""
        self._publisher.publish(message)


class _Newcomers(rospy.SubscribeListener):  # type: ignore[misc]  # rospy has no types
    """Notes that somebody has subscribed."""

    are_there = False

    def peer_subscribe(self, *_: object) -> None:
        """Note it; rospy calls this in a thread of its own."""
        self.are_there = True
