"""Bags of any kind as streams: read as far as they go, or named in one line."""

import bz2

import lz4.frame
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives import bounded_decompression
from diff_encoder_sim.drives.bag_source import bags_in, open_source
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, decompressed
from reencoding_drives import COMPRESSIONS, ROS2, drive, without_index, write_ros1, write_ros2

TOPICS = ('/joint_states', '/world_pose')


def as_streamed(path, topics=TOPICS):
    with open_source(path) as source:
        return [tuple(message) for message in source.messages(topics)], source.fault


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_wherever_a_bag_is_torn_its_beginning_is_read(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(count=101), compression, chunk_bytes=4000)
    content, (whole, _) = path.read_bytes(), as_streamed(path)
    read = []
    for size in range(0, len(content), 2110):
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


@pytest.mark.parametrize('plugin', ['sqlite3', 'mcap'])
def test_bags_of_ros_2(tmp_path, plugin):
    path = write_ros2(tmp_path / 'bag', drive(ROS2), plugin)
    messages, fault = as_streamed(path)
    assert len(messages) == 602 and fault == ''
    with open_source(path) as source:
        assert source.is_cdr and source.topics['/joint_states'] == 'sensor_msgs/msg/JointState'


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


def test_bags_of_every_kind_are_found_in_a_folder_each_once(tmp_path):
    of_ros2 = write_ros2(tmp_path / 'of_ros2', drive(ROS2, count=11))
    (tmp_path / 'deep').mkdir()
    others = [tmp_path / 'a.bag', tmp_path / 'b.mcap', tmp_path / 'deep' / 'c.db3']
    for path in (*others, tmp_path / 'notes.txt'):
        path.write_bytes(b'')
    assert bags_in(tmp_path) == sorted([*others, of_ros2])
    assert bags_in(of_ros2) == [of_ros2] and bags_in(tmp_path / 'none') == []


@pytest.mark.parametrize('mode', ['FILE', 'MESSAGE'])
def test_compressed_bags_of_ros_2(tmp_path, mode):
    path = write_ros2(tmp_path / 'bag', drive(ROS2), compression=mode)
    messages, fault = as_streamed(path)
    assert messages == as_streamed(write_ros2(tmp_path / 'plain', drive(ROS2)))[0] and fault == ''


@pytest.mark.parametrize('has_index', [True, False])
def test_zeros_behind_a_bag_of_ros_1_as_a_crash_leaves_them(tmp_path, has_index):
    path = write_ros1(tmp_path / 'a.bag', drive())
    content = path.read_bytes() if has_index else without_index(path.read_bytes())
    path.write_bytes(content + bytes(1 << 20))
    messages, fault = as_streamed(path)
    assert len(messages) == 602 and f'empty record header at byte {len(content)}' in fault


@pytest.mark.parametrize('compression', COMPRESSIONS[1:])
def test_the_sum_of_all_chunks_has_a_bound(tmp_path, monkeypatch, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    messages, _ = as_streamed(path)
    monkeypatch.setattr(bounded_decompression, 'LARGEST_SUM', 50_000)
    monkeypatch.setattr(bounded_decompression, 'LARGEST_RATIO', 0)
    some, fault = as_streamed(path)
    assert some == messages[: len(some)] and 0 < len(some) < len(messages) and 'allowed: at most 50000' in fault


CONTENT = bytes(range(256)) * 4000
SOUND = {'bz2': bz2.compress(CONTENT), 'lz4': lz4.frame.compress(CONTENT), 'none': CONTENT, '': CONTENT}


@pytest.mark.parametrize('compression', SOUND)
def test_what_is_as_large_as_it_says_is_decompressed(compression):
    for said in (len(CONTENT), LARGEST_CHUNK):
        assert decompressed(compression, SOUND[compression], said) == CONTENT


@pytest.mark.parametrize(
    ('compression', 'content', 'said', 'complaint'),
    [
        ('bz2', SOUND['bz2'], 1000, 'larger than the 1000 bytes'),
        ('lz4', SOUND['lz4'], 1000, 'larger than the 1000 bytes'),
        ('bz2', b'', LARGEST_CHUNK + 1, f'allowed: at most {LARGEST_CHUNK}'),
        ('zstd', b'no such thing', LARGEST_CHUNK, 'cannot be decompressed: .'),
        ('xz', b'x', LARGEST_CHUNK, "compressed by 'xz'; expected bz2, lz4, zstd or none"),
    ],
)
def test_what_cannot_be_decompressed_is_refused(compression, content, said, complaint):
    with pytest.raises(InputFault, match=complaint):
        decompressed(compression, content, said)
