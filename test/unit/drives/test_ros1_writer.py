"""The writer of ROS 1 bags beside rosbags' own."""

import random

from rosbags.rosbag1 import Writer

from diff_encoder_sim.drives.ros1_writer import Ros1Writer, record_header
from diff_encoder_sim.drives.typestore import noetic_store

TYPES = ['std_msgs/msg/String', 'nav_msgs/msg/Odometry', 'rosgraph_msgs/msg/Clock']


def test_equal_messages_are_equal_bytes_over_several_chunks(tmp_path):
    rng = random.Random(1)
    messages = [
        (rng.randrange(3), 1 + 7_000_000 * (number // 2), bytes(rng.choices(range(256), k=rng.choice((0, 8, 700)))))
        for number in range(4000)
    ]
    for name, kind in (('ours.bag', Ros1Writer), ('theirs.bag', Writer)):
        with kind(tmp_path / name) as bag:
            bag.chunk_threshold = 50_000
            connections = [
                bag.add_connection(f'/topic{number}', type_, typestore=noetic_store())
                for number, type_ in enumerate(TYPES)
            ]
            for number, time_ns, message in messages:
                if kind is Ros1Writer:
                    bag.write_message(connections[number].id, record_header(connections[number].id), time_ns, message)
                else:
                    bag.write(connections[number], time_ns, message)
    ours, theirs = ((tmp_path / name).read_bytes() for name in ('ours.bag', 'theirs.bag'))
    assert ours == theirs and len(ours) > 800_000
