"""What every kind of bag is read as: connections, and the messages that came over them."""

from __future__ import annotations

from typing import NamedTuple


class BagConnection(NamedTuple):
    """One topic's publisher as the bag describes it."""

    topic: str
    message_type: str  # as rosbags spells it
    md5sum: str = ''  # of the type's definition; ROS 2 has none
    node: str = ''  # that published; ROS 2 does not record it


class Message(NamedTuple):
    """One message as it was recorded."""

    topic: str
    time_ns: int  # when it was recorded, by the recorder's clock
    raw: bytes
    node: str = ''  # of its connection
