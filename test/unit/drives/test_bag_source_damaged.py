"""Bags that are damaged or wrong inside: what is before the damage is read, in little time, and the damage is named."""

import bz2
import struct
import time

import lz4.frame
import pytest

import bag_bombs as bombs
from diff_encoder_sim.drives import bounded_decompression
from diff_encoder_sim.drives.bag_source import open_source
from reencoding_drives import COMPRESSIONS, ROS2, drive, without_index, write_ros1, write_ros2
from reencoding_runs import run

TOPICS = ('/joint_states', '/world_pose')
COUNT = 602  # messages of `drive`
LONGEST_S = 10.0
LARGE = 200 << 20


def read(path):
    """(messages, fault)"""
    begin_s = time.process_time()
    with open_source(path) as source:
        messages = [tuple(message) for message in source.messages(TOPICS)]
        fault = source.fault
    assert time.process_time() - begin_s < LONGEST_S
    return messages, fault


def write_sparse(path, content, zeros=LARGE):
    """Write zeros behind the content, which take no place on the disk."""
    path.write_bytes(content)
    with open(path, 'r+b') as file:
        file.truncate(len(content) + zeros)
    return path


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    return write_ros1(tmp_path_factory.mktemp('whole') / 'whole.bag', drive())


@pytest.fixture(scope='module')
def chunk(whole):
    """The records of the first chunk."""
    content = whole.read_bytes()
    begin = content.index(b'size=') + 9
    size = int.from_bytes(content[begin : begin + 4], 'little')
    return content[begin + 4 : begin + 4 + size]


@pytest.mark.timeout(60)
@pytest.mark.parametrize('has_index', [True, False])
def test_zeros_behind_a_bag_of_ros_1(tmp_path, whole, has_index):
    content = whole.read_bytes() if has_index else without_index(whole.read_bytes())
    messages, fault = read(write_sparse(tmp_path / 'a.bag', content))
    assert len(messages) == COUNT and f'empty record header at byte {len(content)}' in fault


@pytest.mark.timeout(60)
def test_zeros_behind_a_chunk_that_was_still_being_written(tmp_path, whole, chunk):
    """It has no length yet, so that all zeros seem to belong to it."""
    content = without_index(whole.read_bytes())
    last = bombs.ros1_chunk('none', chunk, 0)
    last = last[: -len(chunk) - 4] + bytes(4) + chunk
    messages, fault = read(write_sparse(tmp_path / 'a.bag', content + last))
    assert COUNT < len(messages) < 2 * COUNT and f'byte {len(chunk)} of the content' in fault


@pytest.mark.timeout(60)
def test_zeros_in_a_compressed_chunk(tmp_path, whole, chunk):
    zeros = bytes(100 << 20)
    bad = bombs.ros1_chunk('lz4', lz4.frame.compress(chunk + zeros), len(chunk) + len(zeros))
    good = bombs.ros1_chunk('none', chunk, len(chunk))
    path = tmp_path / 'a.bag'
    path.write_bytes(without_index(whole.read_bytes()) + bad + good)
    messages, fault = read(path)
    of_chunk = (len(messages) - COUNT) // 2
    assert messages[:of_chunk] == messages[COUNT : COUNT + of_chunk] == messages[COUNT + of_chunk :]
    assert f'empty record header at byte {len(chunk)} of the content' in fault


@pytest.mark.parametrize('compression', COMPRESSIONS[1:])
def test_the_sum_of_all_chunks_has_a_bound(tmp_path, monkeypatch, compression):
    path = write_ros1(tmp_path / 'a.bag', drive(), compression)
    messages, fault = read(path)
    assert len(messages) == COUNT and not fault
    monkeypatch.setattr(bounded_decompression, 'LARGEST_SUM', 50_000)
    monkeypatch.setattr(bounded_decompression, 'LARGEST_RATIO', 0)
    some, fault = read(path)
    assert some == messages[: len(some)] and 0 < len(some) < COUNT and 'allowed: at most 50000' in fault


def test_a_small_file_of_many_bombs_ends_soon(tmp_path):
    """Each is within the limit of a chunk, and they become 100 GB together."""
    path = write_ros1(tmp_path / 'a.bag', drive())
    bomb = bz2.compress(b'\x04\0\0\0op=\x04\0\0\0\0' + bytes(1 << 26))
    chunks = bombs.ros1_chunk('bz2', bomb, 1 << 27) * 1500
    path.write_bytes(without_index(path.read_bytes()) + chunks)
    messages, fault = read(path)
    assert len(messages) == COUNT and 'allowed: at most' in fault


@pytest.mark.parametrize('plugin', [None, 'sqlite3', 'mcap'])
def test_a_message_of_a_time_that_no_bag_of_ros_1_can_have_is_left_out(tmp_path, plugin):
    """Commands write bags of ROS 1 of what they read."""
    if plugin:
        rows = drive(ROS2)
        rows.append((rows[0][0], 2**32 * 10**9, rows[0][2]))
        path = write_ros2(tmp_path / 'a', rows, plugin)
    else:
        path = write_ros1(tmp_path / 'a.bag', drive())
        content = path.read_bytes()
        of_first = b'time=' + struct.pack('<2I', 5, 10_000_000)
        assert of_first in content
        path.write_bytes(content.replace(of_first, b'time=' + struct.pack('<2I', 2**32 - 1, 4 * 10**9)))
    run(path, '--ppr', '90', '--out', tmp_path / 'out')
    assert 'has no time before' in read(path)[1]
