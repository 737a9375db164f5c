"""record_trial: records the topics of the running trial without message loss.

`rosbag record` drops the oldest messages of its queue (100 per topic, 50 ms at rtf:=0). Here a slow disk or a loaded
processor delays the publishers instead.
"""

from __future__ import annotations

import contextlib
import os
import time
from functools import partial
from pathlib import Path
from typing import Dict, Mapping, Optional, Sequence, Tuple

import genpy
import rospy
from rosbags.rosbag1.writer import WriteChunk
from rosgraph_msgs.msg import Clock

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_files import Ros1File, encode_record, record_header
from diff_encoder_sim.drives.message_encoders import encode_clock
from diff_encoder_sim.drives.topics import CLOCK, RECORDED_LIVE
from diff_encoder_sim.drives.trial_bag import EARLIEST_NS
from diff_encoder_sim.ros.messages import clock_ns, ns_from_stamp, subscriber
from diff_encoder_sim.ros.node import CALLBACKS, executable, read_every_tick, required_trial_plan


class Recorder:
    """Writes each message immediately, and renames the complete bag."""

    def __init__(self, path: Path, topics: Sequence[str]) -> None:
        """Open the bag and subscribe to the topics; ConfigError if the file cannot be created."""
        self._path, self._unfinished = path, path.with_name(path.name + UNFINISHED_SUFFIX)
        self.last_message_s = time.monotonic()
        read_every_tick()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._bag: Optional[RecordedBag] = RecordedBag(self._unfinished)
        except OSError as error:
            raise ConfigError(f'bag: {path} cannot be created: {error.strerror}') from None
        for topic in topics:  # rospy's subscription to /clock, which shares the connection, has a type
            subscriber(topic, Clock if topic == CLOCK else rospy.AnyMsg, partial(self._write, topic))
        rospy.on_shutdown(self.finish)

    def finish(self, is_kept: bool = True) -> None:
        """Close the bag, and rename or delete it; later messages are not recorded."""
        with CALLBACKS:
            bag, self._bag = self._bag, None
            if bag is None:
                return
            if is_kept:
                bag.close()
                os.replace(str(self._unfinished), str(self._path))
            else:
                bag.abandon()
                self._unfinished.unlink()

    def _write(self, topic: str, message: genpy.Message) -> None:
        self.last_message_s = time.monotonic()
        if self._bag is None:
            return
        # Attributes of rospy: bytes of an AnyMsg, and header of the publisher. /clock is deserialized by rospy.
        content = encode_clock(ns_from_stamp(message.clock)) if topic == CLOCK else message._buff
        try:
            self._bag.record(topic, message._connection_header, max(clock_ns(), EARLIEST_NS), content)
        except OSError as error:
            rospy.logfatal('recording ends: %s cannot be written: %s', self._unfinished, error.strerror)
            rospy.signal_shutdown('recording failed')


main = executable('record_trial', lambda: Recorder(Path(required_trial_plan().bag), RECORDED_LIVE))


class RecordedBag(Ros1File):
    """ROS 1 bag with LZ4 compression; not thread-safe."""

    def __init__(self, path: Path) -> None:
        """Open a file, and overwrite one from a killed recorder; OSError if it cannot be created."""
        with contextlib.suppress(FileNotFoundError):
            path.unlink()
        super().__init__(path, is_compressed=True)
        self._known: Dict[Tuple[str, ...], Tuple[int, bytes]] = {}

    def record(self, topic: str, publisher: Mapping[str, str], time_ns: int, content: bytes) -> None:
        """Write a serialized message; `publisher` is the header of its connection."""
        key = (topic, publisher['md5sum'], publisher.get('callerid', ''), publisher.get('latching', '0'))
        if key not in self._known:
            kind, text = publisher['type'].replace('/', '/msg/'), publisher['message_definition']
            node, latching = publisher.get('callerid'), int(publisher.get('latching', '0'))
            made = self.add_connection(topic, kind, msgdef=text, md5sum=key[1], callerid=node, latching=latching)
            self._known[key] = made.id, record_header(made.id)
        connection_id, header = self._known[key]
        self.write_prepared([(connection_id, time_ns, encode_record(header, time_ns, content))])

    def write_chunk(self, chunk: WriteChunk) -> None:
        """Write a chunk with an index sorted by time, also after a reset of time."""
        for places in chunk.connections.values():
            places.sort()
        super().write_chunk(chunk)
