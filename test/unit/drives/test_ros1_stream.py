"""ROS 1 bags as streams: records, and what rosbags reads or does not."""

import re

import pytest
from rosbags.rosbag1 import Reader

from diff_encoder_sim.drives.ros1_stream import Ros1Stream
from reencoding_drives import COMPRESSIONS, drive, with_fields_in_order, without_index, write_ros1

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


def test_one_topic_of_a_bag_again_and_again(plain):
    source = Ros1Stream(plain)
    assert source.topics == {
        '/joint_states': 'sensor_msgs/msg/JointState',
        '/world_pose': 'geometry_msgs/msg/PoseStamped',
    }
    for _ in range(2):
        assert {message.topic for message in source.messages(['/world_pose'])} == {'/world_pose'}


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_bag_without_index(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    whole, _ = as_streamed(path)
    active = tmp_path / 'a.bag.active'
    active.write_bytes(without_index(path.read_bytes()))
    messages, fault = as_streamed(active)
    assert messages == whole
    assert fault == 'no index, as after a crash (rosbag reindex mends what can be mended)'


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
