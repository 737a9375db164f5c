"""Copies some topics of any bag into a bag of ROS 1, for programs that read no other: rosbag play, for one."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, Sequence

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.bag_files import Ros1File
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.topics import RecordedTopic
from diff_encoder_sim.drives.trial_bag import EARLIEST_NS
from diff_encoder_sim.drives.typestore import to_ros1


def write_ros1_copy(path: Path, source: BagSource, topics: Sequence[str], again_after_ns: int = 0) -> None:
    """Write the messages of some topics, which are of recorded types, as far as they can be read.

    Args:
        path: of the new bag.
        source: what is copied.
        topics: of the messages.
        again_after_ns: unless 0, the last message of the first topic is at the end once more, so long after all.

    Raises:
        OSError: the bag cannot be written.
    """
    bag = Ros1File(path)
    try:
        publishers: Dict[str, int] = {}
        last, newest_ns = b'', EARLIEST_NS
        for message in source.messages(topics):
            kind = source.topics[message.topic]
            if message.topic not in publishers:
                publishers[message.topic] = bag.add_publisher(RecordedTopic(message.topic, kind, ()), message.node)
            with contextlib.suppress(InputFault):  # a torn message, which no node could take
                raw = to_ros1(message.raw, kind) if source.is_cdr else message.raw
                newest_ns = max(message.time_ns, newest_ns)
                bag.write([bag.prepare(publishers[message.topic], max(message.time_ns, EARLIEST_NS), raw)])
                last = raw if message.topic == topics[0] else last
        if again_after_ns and last:
            bag.write([bag.prepare(publishers[topics[0]], newest_ns + again_after_ns, last)])
        bag.close()
    except BaseException:
        bag.abandon()
        raise
