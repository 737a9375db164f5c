"""Copies some topics of any bag into a bag of ROS 1, for programs that read no other, such as rosbag play."""

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
    """Write the readable messages of some topics, which are of recorded types.

    Args:
        path: of the new bag.
        source: the bag to copy.
        topics: of the messages.
        again_after_ns: unless 0, repeat the last message of the first topic this long after all others.

    Raises:
        OSError: the bag cannot be written.
    """
    publishers: Dict[str, int] = {}
    last, newest_ns = b'', EARLIEST_NS
    with contextlib.closing(Ros1File(path)) as bag:
        for message in source.messages(topics):
            kind = source.topics[message.topic]
            if message.topic not in publishers:
                publishers[message.topic] = bag.add_publisher(RecordedTopic(message.topic, kind, ()), message.node)
            with contextlib.suppress(InputFault):  # a torn message, which no node could read
                raw = to_ros1(message.raw, kind) if source.is_cdr else message.raw
                newest_ns = max(message.time_ns, newest_ns)
                bag.write_prepared([bag.prepare(publishers[message.topic], max(message.time_ns, EARLIEST_NS), raw)])
                last = raw if message.topic == topics[0] else last
        if again_after_ns and last:
            bag.write_prepared([bag.prepare(publishers[topics[0]], newest_ns + again_after_ns, last)])
