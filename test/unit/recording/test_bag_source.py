"""Bags as streams: what rosbags reads, and what it does not."""

import re

import pytest
from rosbags.rosbag1 import Reader

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.recording.bag_source import open_source
from diff_encoder_sim.serialization.ros1_stream import Ros1Stream
from reencoding_drives import COMPRESSIONS, ROS2, drive, with_fields_in_order, without_index, write_ros1, write_ros2

TOPICS = ('/joint_states', '/world_pose')


def as_rosbags_reads(path):
    with Reader(path) as reader:
        return [(connection.topic, time_ns, bytes(raw)) for connection, time_ns, raw in reader.messages()]


def as_streamed(path, topics=TOPICS):
    with open_source(path) as source:
        return [tuple(message) for message in source.messages(topics)], source.fault


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
    assert fault == 'no index, as after a crash'


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


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_wherever_a_bag_is_torn_its_beginning_is_read(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(count=101), compression, chunk_bytes=4000)
    content, (whole, _) = path.read_bytes(), as_streamed(path)
    read = []
    for size in range(0, len(content), 211):
        path.write_bytes(content[:size])
        try:
            messages, fault = as_streamed(path)
        except ConfigError as error:
            assert str(path) in str(error) and '\n' not in str(error)
            continue
        assert messages == whole[: len(messages)]
        assert fault or messages == whole  # what is missing may be index alone
        read.append(len(messages))
    assert read == sorted(read) and read[-1] == len(whole)


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


@pytest.mark.parametrize('plugin', ['sqlite3', 'mcap'])
def test_bags_of_ros_2(tmp_path, plugin):
    path = write_ros2(tmp_path / 'bag', drive(ROS2), plugin)
    messages, fault = as_streamed(path)
    assert len(messages) == 602 and fault == ''
    with open_source(path) as source:
        assert source.is_cdr and source.topics['/joint_states'] == 'sensor_msgs/msg/JointState'


@pytest.mark.parametrize(('plugin', 'suffix'), [('sqlite3', 'db3'), ('mcap', 'mcap')])
def test_wherever_a_bag_of_ros_2_is_torn_it_is_read_or_named(tmp_path, plugin, suffix):
    whole = next(write_ros2(tmp_path / 'bag', drive(ROS2, count=101), plugin).glob(f'*.{suffix}')).read_bytes()
    path = tmp_path / f'torn.{suffix}'
    for size in range(0, len(whole), len(whole) // 40):
        path.write_bytes(whole[:size])
        try:
            as_streamed(path)
        except ConfigError as error:
            assert str(error).startswith(f'{path}: ') and '\n' not in str(error)


@pytest.mark.parametrize(
    ('name', 'content', 'text'),
    [
        ('none.bag', None, 'no such bag'),
        ('empty.bag', b'', 'not a readable bag'),
        ('text.bag', b'hello', 'not a readable bag'),
        ('text.db3', b'hello', 'not a readable bag'),
        ('text.mcap', b'hello', 'not a readable bag'),
        ('begun.bag', b'#ROSBAG V2.0\n', 'no message in it'),
    ],
)
def test_what_is_no_bag_is_named_in_one_line(tmp_path, name, content, text):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as error:
        as_streamed(path)
    assert str(path) in str(error.value) and text in str(error.value) and '\n' not in str(error.value)
