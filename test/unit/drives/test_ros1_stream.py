"""ROS 1 bags: read as streams, copied, and written."""

import random
import re

import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Reader, Writer

from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.ros1_copy import write_ros1_copy
from diff_encoder_sim.drives.ros1_stream import Ros1Stream
from diff_encoder_sim.drives.ros1_writer import Ros1Writer, record_header
from diff_encoder_sim.drives.typestore import noetic_store
from reencoding_drives import (
    COMPRESSIONS,
    ROS1,
    ROS2,
    drive,
    with_fields_in_order,
    without_index,
    write_ros1,
    write_ros2,
)

TOPICS = ('/joint_states', '/world_pose')


def as_rosbags_reads(path):
    with Reader(path) as reader:
        return [(connection.topic, time_ns, bytes(raw)) for connection, time_ns, raw in reader.messages()]


def as_streamed(path, topics=TOPICS):
    source = Ros1Stream(path)
    return [message[:3] for message in source.messages(topics)], source.fault


@pytest.fixture(scope='module')
def plain(tmp_path_factory):
    return write_ros1(tmp_path_factory.mktemp('plain') / 'plain.bag', drive())


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_whole_bag(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    messages, fault = as_streamed(path)
    assert sorted(messages) == sorted(as_rosbags_reads(path)) and len(messages) == 602
    assert fault == ''
    assert [time_ns for _, time_ns, _ in messages] == sorted(time_ns for _, time_ns, _ in messages)


def test_a_chunk_that_was_still_being_written(tmp_path, plain):
    content = without_index(plain.read_bytes())
    last = [match.start() for match in re.finditer(b'compression=none', content)][-1]
    size_at = content.index(b'size=', last) + 9  # of the data, after the uncompressed size
    path = tmp_path / 'a.bag'
    path.write_bytes(content[:size_at] + bytes(4) + content[size_at + 4 : -300])
    messages, fault = as_streamed(path)
    whole, _ = as_streamed(plain)
    assert whole[: len(messages)] == messages and len(messages) > 0.9 * len(whole)
    assert 'torn' in fault


@pytest.mark.parametrize('order', [('conn', 'op', 'time'), ('time', 'op', 'conn'), ('time', 'conn', 'op')])
def test_the_order_of_a_records_fields_does_not_matter(tmp_path, plain, order):
    path = tmp_path / 'a.bag'
    path.write_bytes(with_fields_in_order(plain.read_bytes(), order))
    assert path.read_bytes() != plain.read_bytes()
    assert as_streamed(path) == as_streamed(plain)


@pytest.mark.parametrize('compression', COMPRESSIONS[1:])
def test_a_damaged_chunk_is_left_out(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    content, (whole, _) = bytearray(path.read_bytes()), as_streamed(path)
    place = content.index(b'BZh9' if compression == COMPRESSIONS[1] else b'\x04\x22\x4d\x18')
    content[place : place + 10] = b'\xff' * 10
    path.write_bytes(bytes(content))
    messages, fault = as_streamed(path)
    assert 0 < len(messages) < len(whole) and set(messages) < set(whole)
    assert 'cannot be decompressed' in fault


def copied(path, topics=TOPICS, **options):
    """[(topic, time, message without the seq of its header)]"""
    copy = path.parent / 'copy.bag'
    with open_source(path) as source:
        write_ros1_copy(copy, source, topics, **options)
    with AnyReader([copy]) as reader:
        return [(connection.topic, time_ns, bytes(raw)[4:]) for connection, time_ns, raw in reader.messages()]


def original():
    return [(topic, time_ns, ROS1.raw(message)[4:]) for topic, time_ns, message in drive()]


@pytest.mark.parametrize('of_ros2', [False, True])
def test_every_message_is_in_the_copy(tmp_path, of_ros2):
    path = write_ros2(tmp_path / 'a', drive(ROS2)) if of_ros2 else write_ros1(tmp_path / 'a.bag', drive())
    assert sorted(copied(path)) == sorted(original())


def test_the_last_message_of_the_wheels_can_be_there_again_after_all_others(tmp_path):
    found = copied(write_ros1(tmp_path / 'a.bag', drive()), again_after_ns=5)
    *others, (topic, time_ns, content) = found
    assert sorted(others) == sorted(original())
    last = [(time_ns, content) for topic, time_ns, content in others if topic == '/joint_states'][-1]
    assert (topic, content) == ('/joint_states', last[1]) and time_ns == max(time_ns for _, time_ns, _ in others) + 5


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
