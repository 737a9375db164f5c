"""ROS 1 bags as streams: records, and what rosbags reads or does not."""

import io
import re

import pytest
from rosbags.rosbag1 import Reader

from diff_encoder_sim.drives.ros1_stream import Ros1Stream, header_fields, read_header, records, value_places
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


@pytest.mark.parametrize('fraction', [0.3, 0.6, 0.99])
def test_who_has_a_torn_bag_is_told_what_mends_it(tmp_path, plain, fraction):
    content = plain.read_bytes()
    torn = tmp_path / 'torn.bag'
    torn.write_bytes(content[: int(fraction * len(content))])
    _, fault = as_streamed(torn)
    assert fault.endswith(' (rosbag reindex mends what can be mended)')


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


def with_length(content):
    return len(content).to_bytes(4, 'little') + content


HEADER = with_length(b'op=\x02') + with_length(b'conn=\x01\x00\x00\x00') + with_length(b'topic=/a=b')


def test_fields_are_found_by_name_whatever_their_values():
    assert header_fields(HEADER) == {b'op': b'\x02', b'conn': b'\x01\x00\x00\x00', b'topic': b'/a=b'}
    assert HEADER[value_places(HEADER)[b'topic'] :] == b'/a=b'


def test_a_header_is_read_as_far_as_it_is_sound():
    assert header_fields(b'') == {}
    assert header_fields(HEADER[:-1]) == {b'op': b'\x02', b'conn': b'\x01\x00\x00\x00'}
    assert header_fields(with_length(b'op=\x02') + with_length(b'nothing')) == {b'op': b'\x02'}


def test_whole_records_are_found_in_a_chunk_that_is_cut_off():
    record = with_length(HEADER) + with_length(b'data')
    for size in range(2 * len(record) + 1):
        found = list(records((record + record)[:size]))
        assert len(found) == size // len(record)
        for header_at, data_at, end in found:
            assert (record + record)[header_at : data_at - 4] == HEADER and (record + record)[data_at:end] == b'data'


def test_a_header_is_none_where_the_file_ends_or_the_length_is_absurd():
    whole = with_length(HEADER)
    assert read_header(io.BytesIO(whole))[b'topic'] == b'/a=b'
    assert all(read_header(io.BytesIO(whole[:size])) is None for size in range(len(whole)))
    assert read_header(io.BytesIO(b'\xff\xff\xff\xff' + HEADER)) is None
