"""record_trial: records the running trial's topics without losing a message.

`rosbag record` holds 100 messages a topic in its queue and drops the oldest: at rtf:=0 that is 50 ms on a busy host.
Here a slow disk or a loaded processor holds the publishers back instead.
"""

from __future__ import annotations

import os
import threading
import time
from pathlib import Path
from typing import List, Optional, Sequence

import genpy
import rospy
from rosgraph_msgs.msg import Clock

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import check_stamp
from diff_encoder_sim.drives.basic_messages import encode_clock
from diff_encoder_sim.drives.topics import CLOCK, RECORDED_LIVE
from diff_encoder_sim.drives.trial_bag import EARLIEST_NS
from diff_encoder_sim.ros.clock_pauses import read_every_tick
from diff_encoder_sim.ros.conversions import ns_from_stamp
from diff_encoder_sim.ros.node import log, run_node
from diff_encoder_sim.ros.recorded_bag import RecordedBag
from diff_encoder_sim.ros.trial_plan import required_trial_plan


class Recorder:
    """Writes each message as it comes; the bag gets its name when it is complete."""

    def __init__(self, path: Path, topics: Sequence[str]) -> None:
        """Open the bag and subscribe to the topics.

        Raises:
            ConfigError: the file cannot be created.
        """
        self._path = path
        self._unfinished = self._path.with_name(self._path.name + UNFINISHED_SUFFIX)
        self._lock = threading.Lock()  # each topic comes in a thread of its own
        self._newest_ns = EARLIEST_NS
        self.last_message_s = time.monotonic()
        read_every_tick()
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._bag: Optional[RecordedBag] = RecordedBag(self._unfinished)
        except OSError as error:
            raise ConfigError(f'bag: {self._path} cannot be created: {error.strerror}') from None
        self._subscribers: List[rospy.Subscriber] = [
            # -1: no limit; rospy's own subscription to /clock, which shares the connection, has one.
            rospy.Subscriber(
                topic,
                Clock if topic == CLOCK else rospy.AnyMsg,
                self._write,
                callback_args=topic,
                queue_size=-1,
                tcp_nodelay=True,
            )
            for topic in topics
        ]
        rospy.on_shutdown(self.finish)

    def finish(self) -> None:
        """Close the bag and give it its name; messages that come later are not recorded."""
        with self._lock:
            bag, self._bag = self._bag, None
            if bag is not None:
                bag.close()
                os.replace(str(self._unfinished), str(self._path))

    def discard(self) -> None:
        """Delete the unfinished bag."""
        with self._lock:
            bag, self._bag = self._bag, None
            if bag is not None:
                bag.abandon()
                self._unfinished.unlink()

    def _write(self, message: genpy.Message, topic: str) -> None:
        self.last_message_s = time.monotonic()
        # Names of rospy's: the bytes of an AnyMsg, and the publisher's header. /clock, which rospy reads, has fields.
        content = encode_clock(ns_from_stamp(message.clock)) if topic == CLOCK else message._buff
        try:
            with self._lock:
                if self._bag is not None:
                    self._bag.record(topic, message._connection_header, self._now_ns(), content)
        except OSError as error:
            rospy.logfatal('recording ends: %s cannot be written: %s', self._unfinished, error.strerror)
            rospy.signal_shutdown('recording failed')

    def _now_ns(self) -> int:
        """Return the clock's time, or the last one before it where the clock shows a time that cannot be."""
        now_ns = ns_from_stamp(rospy.Time.now())
        try:
            check_stamp(now_ns)
        except InputFault as fault:
            log.warning('/clock: %s; recorded with the time before', fault)
        else:
            self._newest_ns = max(now_ns, EARLIEST_NS)
        return self._newest_ns


def main() -> None:
    """Run the node."""
    run_node('record_trial', lambda: Recorder(Path(required_trial_plan().bag), RECORDED_LIVE))
