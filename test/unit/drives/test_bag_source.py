"""Bags of any kind as streams: read as far as they go, or named in one line."""

import re

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import bags_in, open_source
from reencoding_drives import COMPRESSIONS, ROS1, ROS2, drive, without_index, write_ros1, write_ros2

TOPICS = ('/joint_states', '/world_pose')


def read(path, topics=TOPICS):
    source = open_source(path)
    return [message[:3] for message in source.messages(topics)], source.fault


@pytest.fixture(scope='module')
def plain(tmp_path_factory):
    return write_ros1(tmp_path_factory.mktemp('plain') / 'plain.bag', drive())


@pytest.mark.parametrize('compression', COMPRESSIONS)
def test_a_bag_of_ros_1_is_read_up_to_wherever_it_is_torn(tmp_path, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(count=101), compression, chunk_bytes=4000)
    content, (whole, fault) = path.read_bytes(), read(path)
    assert sorted(whole) == sorted((topic, time_ns, ROS1.raw(message)) for topic, time_ns, message in drive(count=101))
    assert whole == sorted(whole, key=lambda message: message[1]) and fault == ''
    counts = []
    for size in range(0, len(content), 2110):
        path.write_bytes(content[:size])
        try:
            messages, fault = read(path)
        except ConfigError as error:
            assert str(path) in str(error) and '\n' not in str(error)
            continue
        assert messages == whole[: len(messages)]
        assert fault or messages == whole  # only the index may be missing
        counts.append(len(messages))
    assert counts == sorted(counts) and counts[-1] == len(whole)


def test_a_chunk_that_was_still_being_written(tmp_path, plain):
    content = without_index(plain.read_bytes())
    last = [match.start() for match in re.finditer(b'compression=none', content)][-1]
    size_at = content.index(b'size=', last) + 9  # of the data, after the uncompressed size
    path = tmp_path / 'a.bag'
    path.write_bytes(content[:size_at] + bytes(4) + content[size_at + 4 : -300])
    (messages, fault), (whole, _) = read(path), read(plain)
    assert whole[: len(messages)] == messages and len(messages) > 0.9 * len(whole) and 'torn' in fault


def test_zeros_behind_a_bag_of_ros_1_as_a_crash_leaves_them(tmp_path, plain):
    content, path = without_index(plain.read_bytes()), tmp_path / 'a.bag'
    path.write_bytes(content + bytes(1 << 20))
    messages, fault = read(path)
    assert len(messages) == 602 and f'empty record header at byte {len(content)}' in fault


def test_the_order_of_a_records_fields_does_not_matter(tmp_path, plain):
    fields = rb'(\x04\0\0\0op=\x02)(\x09\0\0\0conn=.{4})(\x0d\0\0\0time=.{8})'
    path = tmp_path / 'a.bag'
    path.write_bytes(re.sub(fields, rb'\3\2\1', plain.read_bytes(), flags=re.DOTALL))
    assert path.read_bytes() != plain.read_bytes() and read(path) == read(plain)


@pytest.mark.parametrize('compression', COMPRESSIONS[1:])
@pytest.mark.parametrize('is_too_large', [True, False])
def test_a_damaged_chunk_is_left_out(tmp_path, compression, is_too_large):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    content, (whole, _) = bytearray(path.read_bytes()), read(path)
    place = content.index(b'BZh9' if compression == COMPRESSIONS[1] else b'\x04\x22\x4d\x18')
    if is_too_large:  # as it can be made on purpose: 5 kB of bz2 become 2 GB
        place = content.index(b'size=') + 5
        content[place : place + 4] = bytes([100, 0, 0, 0])
    else:
        content[place : place + 10] = b'\xff' * 10
    path.write_bytes(bytes(content))
    messages, fault = read(path)
    assert 0 < len(messages) < len(whole) and set(messages) < set(whole)
    assert ('larger than the 100 bytes' if is_too_large else 'cannot be decompressed') in fault


@pytest.mark.parametrize(
    ('plugin', 'compression'), [('sqlite3', 'NONE'), ('mcap', 'NONE'), ('sqlite3', 'FILE'), ('sqlite3', 'MESSAGE')]
)
def test_bags_of_ros_2(tmp_path, plugin, compression):
    folder = write_ros2(tmp_path / 'bag', drive(ROS2), plugin, compression)
    expected = sorted((topic, time_ns, ROS2.raw(message)) for topic, time_ns, message in drive(ROS2))
    paths = [next(file for file in folder.iterdir() if file.suffix != '.yaml')] if compression == 'NONE' else []
    for path in (folder, *paths):
        messages, fault = read(path)
        assert sorted(messages) == expected and fault == ''
        source = open_source(path)
        assert source.is_cdr and source.topics['/joint_states'] == 'sensor_msgs/msg/JointState'


def test_a_folder_needs_its_metadata(tmp_path):
    path = write_ros2(tmp_path / 'bag', drive(ROS2))
    (path / 'metadata.yaml').write_text('rosbag2_bagfile_information: {relative_file_paths: []}')
    with pytest.raises(ConfigError, match='no relative_file_paths'):
        read(path)
    (path / 'metadata.yaml').unlink()
    with pytest.raises(ConfigError, match=r'bag/metadata\.yaml: cannot be read'):
        read(path)


@pytest.mark.parametrize(
    ('name', 'content', 'text'),
    [
        ('none.bag', None, 'no such bag'),
        ('empty.bag', b'', 'not a readable bag'),
        ('text.db3', b'SQLite format 3\0', 'not a readable bag'),
        ('begun.mcap', b'\x89MCAP0\r\n', 'no message in it'),
        ('begun.bag', b'#ROSBAG V2.0\n', 'no message in it'),
    ],
)
def test_what_is_no_bag_is_named_in_one_line(tmp_path, name, content, text):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as error:
        read(path)
    assert str(path) in str(error.value) and text in str(error.value) and '\n' not in str(error.value)


def test_bags_of_every_kind_are_found_in_a_folder_each_once(tmp_path):
    of_ros2 = write_ros2(tmp_path / 'of_ros2', drive(ROS2, count=11))
    (tmp_path / 'deep').mkdir()
    others = [tmp_path / 'a.bag', tmp_path / 'b.mcap', tmp_path / 'deep' / 'c.db3']
    for path in (*others, tmp_path / 'notes.txt'):
        path.write_bytes(b'')
    assert bags_in(tmp_path) == sorted([*others, of_ros2])
    assert bags_in(of_ros2) == [of_ros2] and bags_in(tmp_path / 'none') == []
