"""Topics whose messages the core encodes and decodes: genpy, which makes objects of them, takes four times as long."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Callable, Mapping, Optional, Type

import genpy
import rospy

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.field_reader import STAMP_AT, TORN
from diff_encoder_sim.drives.primitives import TIME, with_seq
from diff_encoder_sim.ros.node import log, publisher, subscriber
from diff_encoder_sim.ros.stamped_subscriber import check_stamp_now


class EncodedMessage(rospy.AnyMsg):  # type: ignore[misc]  # rospy has no types
    """The bytes of a message of one type, in place of its fields; `encoded_class` makes the class of each type."""

    _has_header = False

    def __init__(self, content: bytes = b'') -> None:
        super().__init__()
        self.content = content
        self.header = SimpleNamespace(seq=0, frame_id='')  # rospy numbers the messages here

    def serialize(self, buff: Any) -> None:
        """Write the message, with its number where it has a header."""
        buff.write(with_seq(self.content, self.header.seq) if self._has_header else self.content)

    def deserialize(self, content: bytes) -> EncodedMessage:
        """Take the bytes as they are."""
        self.content = content
        return self


def encoded_class(message_class: Type[genpy.Message]) -> Type[EncodedMessage]:
    """Return the class of a type's encoded messages: rospy compares it with those of other nodes as it does any."""
    names = ('_type', '_md5sum', '_full_text', '_has_header')
    described = {name: getattr(message_class, name) for name in names}
    made: Type[EncodedMessage] = type(f'Encoded{message_class.__name__}', (EncodedMessage,), described)
    return made


class EncodedPublisher:
    """Publishes encoded messages as `publisher` does."""

    def __init__(
        self,
        topic: str,
        message_class: Type[genpy.Message],
        latch: bool = False,
        headers: Optional[Mapping[str, str]] = None,
    ) -> None:
        self._class = encoded_class(message_class)
        self._publisher = publisher(topic, self._class, latch, headers)

    def publish(self, content: bytes) -> None:
        """Publish a message; the seq of a leading header is filled in."""
        self._publisher.publish(self._class(content))


def encoded_subscriber(
    topic: str, message_class: Type[genpy.Message], callback: Callable[[bytes], None]
) -> rospy.Subscriber:
    """Subscribe as `subscriber` does; the callback gets the bytes of each message."""
    return subscriber(topic, encoded_class(message_class), lambda message: callback(message.content))


def encoded_stamped_subscriber(
    topic: str, message_class: Type[genpy.Message], callback: Callable[[bytes], None]
) -> rospy.Subscriber:
    """Subscribe as `stamped_subscriber` does.

    A message whose stamp cannot be, or for which the callback raises an InputFault, is dropped with a warning.
    """
    resolved_name = rospy.resolve_name(topic)

    def take(content: bytes) -> None:
        try:
            check_stamp_now(encoded_stamp_ns(content))
        except InputFault as fault:
            log.warning('%s: message dropped: %s', resolved_name, fault)
            return
        try:
            callback(content)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', resolved_name, fault)

    return encoded_subscriber(topic, message_class, take)


def encoded_stamp_ns(content: bytes) -> int:
    """Return the stamp of a message that begins with a header.

    Raises:
        InputFault: the message is torn.
    """
    if len(content) < STAMP_AT + TIME.size:
        raise InputFault(TORN)
    seconds, nanoseconds = TIME.unpack_from(content, STAMP_AT)
    return int(seconds * NANOSECONDS_PER_SECOND + nanoseconds)
