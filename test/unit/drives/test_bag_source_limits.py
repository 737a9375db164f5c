"""Small bags that would fill the memory are read as far as they are sound, in little memory."""

import subprocess
import sys

import pytest

import bag_bombs as bombs
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK
from places import SOURCE
from reencoding_drives import drive, write_ros1

# Reads a bag, and says how many messages it has, what is wrong, and how much memory reading has taken [MB].
READ = """
import resource, sys
from pathlib import Path
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import open_source

def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024

before_mb = peak_mb()
try:
    with open_source(Path(sys.argv[1])) as source:
        count = sum(1 for _ in source.messages(source.topics))
        print(f'{count} {source.fault}')
except ConfigError as error:
    print(f'0 {error}')
print(peak_mb() - before_mb)
"""


def read(path):
    """(number of messages, fault, [MB] of memory)"""
    result = subprocess.run(
        [sys.executable, '-c', READ, str(path)], capture_output=True, text=True, env={'PYTHONPATH': str(SOURCE)}
    )
    assert result.returncode == 0 and result.stderr == '', result.stderr
    first, memory = result.stdout.splitlines()
    count, _, fault = first.partition(' ')
    return int(count), fault, int(memory)


@pytest.mark.parametrize(
    ('said', 'fault'),
    [
        (1000, 'becomes larger than the 1000 bytes that it says'),
        (bombs.TWO_GB, f'says that it has 2000000000 bytes; allowed: at most {LARGEST_CHUNK}'),
    ],
)
def test_two_gigabytes_in_a_bag_of_ros_1(tmp_path, said, fault):
    path = write_ros1(tmp_path / 'a.bag', drive(count=11))
    bombs.with_ros1_chunk(path, 'bz2', bombs.BZ2_OF_TWO_GB, said)
    count, found, memory_mb = read(path)
    assert count == 14 and fault in found and memory_mb < 50


def test_a_chunk_that_was_still_being_written_is_not_believed_either(tmp_path):
    path = write_ros1(tmp_path / 'a.bag', drive(count=11))
    torn = bombs.ros1_chunk('lz4', bombs.lz4_of_zeros(), 0)
    at = torn.index(b'\x04\x22\x4d\x18')
    path.write_bytes(path.read_bytes() + torn[: at - 4] + bytes(4) + torn[at:])
    count, found, memory_mb = read(path)
    assert count == 14 and f'larger than the {LARGEST_CHUNK} bytes' in found and memory_mb < 4 * LARGEST_CHUNK >> 20


def test_a_compressed_message_of_sqlite(tmp_path):
    bombs.write_db3(tmp_path / 'a.db3', bombs.zstd_of_zeros())
    _, fault, memory_mb = read(bombs.write_metadata(tmp_path, 'a.db3', 'message'))
    assert 'becomes larger' in fault and memory_mb < 4 * LARGEST_CHUNK >> 20
