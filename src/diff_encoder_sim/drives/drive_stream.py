"""A recorded drive as a stream of messages; the base class of bags and tables."""

from __future__ import annotations

from pathlib import Path
from typing import Collection, Dict, Iterator, NamedTuple

from diff_encoder_sim.base.stamps import LATEST_NS


class Message(NamedTuple):
    """A recorded message."""

    topic: str
    time_ns: int  # of recording, by the recorder's clock
    raw: bytes
    node: str = ''  # publisher; ROS 2 does not record it


class DriveStream:
    """The topics of a recorded drive, and its messages, which may be read several times."""

    is_cdr = False  # messages are encoded for ROS 2

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: Dict[str, str] = {}  # types by topic, as rosbags spells them
        self.definitions: Dict[str, str] = {}  # by type; empty if not recorded
        self.fault = ''  # why not all of it can be read

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of the file, up to damage; OSError if it cannot be read."""
        for message in self._messages(topics):
            if 0 <= message.time_ns < LATEST_NS:
                yield message
            else:
                self.fault = f'damaged: a message on {message.topic} has no time before 2^32 s'

    def _messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics with any time."""
        raise NotImplementedError
