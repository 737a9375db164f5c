"""Small bags that would fill the memory are read as far as they are sound, in little memory."""

import sqlite3
import subprocess
import sys

import pytest

import bag_bombs as bombs
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives import ros2_folder
from diff_encoder_sim.drives.bag_source import open_source
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


@pytest.mark.parametrize(('compression', 'bomb'), [('lz4', bombs.lz4_of_zeros), ('zstd', bombs.zstd_of_zeros)])
def test_an_mcap_chunk_that_becomes_larger_than_it_says(tmp_path, compression, bomb):
    _, fault, memory_mb = read(bombs.write_mcap(tmp_path / 'a.mcap', compression, bomb(), 1000))
    assert 'becomes larger than the 1000 bytes that it says' in fault and memory_mb < 50
    _, fault, _ = read(bombs.write_mcap(tmp_path / 'b.mcap', compression, b'', 1 << 40))
    assert f'says that it has {1 << 40} bytes; allowed: at most {LARGEST_CHUNK}' in fault


def test_a_compressed_message_of_sqlite(tmp_path):
    bombs.write_db3(tmp_path / 'a.db3', bombs.zstd_of_zeros())
    _, fault, memory_mb = read(bombs.write_metadata(tmp_path, 'a.db3', 'message'))
    assert 'becomes larger' in fault and memory_mb < 4 * LARGEST_CHUNK >> 20


BIG = 'GENERATED ALWAYS AS (zeroblob(900000000))'
TOPICS = 'TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)'


@pytest.mark.parametrize(
    'schema',
    [
        {'messages': bombs.MESSAGES.replace('BLOB', f'BLOB {BIG}')},
        {'messages': bombs.MESSAGES.replace('BLOB', f'BLOB {BIG} STORED')},
        {'messages': bombs.MESSAGES.replace('timestamp INTEGER', f'timestamp TEXT {BIG}')},
        {'topics': TOPICS.replace('type TEXT', f'type TEXT {BIG}')},
        {'message_definitions': f'TABLE message_definitions(topic_type TEXT, encoded_message_definition TEXT {BIG})'},
        {'messages': 'VIEW messages AS SELECT 1 AS id, 1 AS topic_id, 1 AS timestamp, zeroblob(900000000) AS data'},
        {'messages': 'VIRTUAL TABLE messages USING fts4(id, topic_id, timestamp, data)'},
    ],
    ids=['data', 'stored', 'timestamp', 'type', 'definition', 'view', 'virtual table'],
)
def test_tables_that_sqlite_would_compute_are_refused(tmp_path, schema):
    path = tmp_path / 'a.db3'
    with sqlite3.connect(str(path)) as database:
        for table in {'topics': TOPICS, 'messages': bombs.MESSAGES, **schema}.values():
            database.execute(f'CREATE {table}')
        if 'topics' not in schema:
            database.execute("INSERT INTO topics VALUES(1, '/odom', 'nav_msgs/msg/Odometry', 'cdr')")
        if 'message_definitions' in schema:
            database.execute("INSERT INTO message_definitions(topic_type) VALUES('nav_msgs/msg/Odometry')")
    database.close()
    count, found, memory_mb = read(path)
    assert count == 0 and 'expected' in found and memory_mb < 50


@pytest.mark.parametrize(
    'row',
    ['(1, 2, 5000000000)', "(1, 2, 'text')", '(1, 2, NULL)', "(1, 9e999, x'00')", "(1, 'soon', x'00')", '(1, 2, 2.5)'],
)
def test_a_message_that_is_no_blob_is_left_out(tmp_path, row):
    """Of a number, Python would make as many zeros."""
    path = bombs.write_db3(tmp_path / 'a.db3', b'1')
    with sqlite3.connect(str(path)) as database:
        database.execute(f'INSERT INTO messages(topic_id, timestamp, data) VALUES{row}')
        database.execute("INSERT INTO messages VALUES(9, 1, 9, x'00')")
    database.close()
    count, fault, memory_mb = read(path)
    assert count == 2 and 'a message on /odom' in fault and memory_mb < 50


def test_topics_with_equal_numbers_do_not_multiply_messages(tmp_path):
    path = tmp_path / 'a.db3'
    with sqlite3.connect(str(path)) as database:
        database.execute(f'CREATE {TOPICS.replace(" PRIMARY KEY", "")}')
        database.execute(f'CREATE {bombs.MESSAGES}')
        database.executemany("INSERT INTO topics VALUES(1, ?, 'nav_msgs/msg/Odometry', 'cdr')", [('/odom',)] * 3000)
        database.executemany('INSERT INTO messages VALUES(?, 1, 1, ?)', [(number, b'') for number in range(3000)])
    database.close()
    assert read(path)[:2] == (3000, '')


def test_a_file_that_is_compressed_as_a_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(ros2_folder, 'LARGEST_FILE', 1 << 24)
    (tmp_path / 'a.db3.zstd').write_bytes(bombs.zstd_of_zeros())
    with pytest.raises(ConfigError, match='a.db3.zstd: becomes larger than that; allowed: at most 16777216 bytes'):
        with open_source(bombs.write_metadata(tmp_path, 'a.db3.zstd', 'file')):
            pass
