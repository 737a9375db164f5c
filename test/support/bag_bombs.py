"""Bags that are small, and that say or become much more than they are."""

import base64
import json
import sqlite3
import struct
import zlib

import lz4.frame

from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK
from diff_encoder_sim.drives.wire import LENGTH
from reencoding_drives import without_index

MESSAGES = 'TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)'

TWO_GB = 2_000_000_000
TOO_LARGE = 2 * LARGEST_CHUNK
PIECE = bytes(1 << 22)

# 2 GB of zeros in 1426 bytes of bz2, which takes half a minute to make.
BZ2_OF_TWO_GB = zlib.decompress(
    base64.b85decode(
        'c-nJ{%CIzaj8qGb<l}sFpE17Af#CoH1BU{GL4&WG(*o6%Tn*Dl<wxa5<wxa5<tdR*44ja~aB`yuNS+C#LSd<iWKXL`cM=dEy))5IM8!hy!Sw?GOo6Wa'
    )
)


def compressed_zeros(compressor, size):
    pieces = [compressor.compress(PIECE) for _ in range(size // len(PIECE))]
    return b''.join(pieces) + compressor.flush()


def lz4_of_zeros(size=TOO_LARGE):
    with lz4.frame.LZ4FrameCompressor() as compressor:
        begin = compressor.begin()
        return begin + compressed_zeros(compressor, size)


def zstd_of_zeros(size=TOO_LARGE):
    return compressed_zeros(_zstd_compressor(), size)


def zstd(data):
    compressor = _zstd_compressor()
    return compressor.compress(data) + compressor.flush()


def _zstd_compressor():
    try:
        from backports.zstd import ZstdCompressor
    except ImportError:
        import zstandard

        return zstandard.ZstdCompressor().compressobj()
    return ZstdCompressor()


def ros1_chunk(compression, data, said):
    fields = {b'op': b'\x05', b'compression': compression.encode(), b'size': LENGTH.pack(said)}
    header = b''.join(LENGTH.pack(len(name) + 1 + len(value)) + name + b'=' + value for name, value in fields.items())
    return LENGTH.pack(len(header)) + header + LENGTH.pack(len(data)) + data


def with_ros1_chunk(path, compression, data, said):
    """Put a chunk behind those of a sound bag, which then has no index."""
    path.write_bytes(without_index(path.read_bytes()) + ros1_chunk(compression, data, said))


def write_db3(path, data=b'', messages=MESSAGES):
    """A database with one topic, and one message if its messages are a table with the usual columns."""
    with sqlite3.connect(str(path)) as database:
        database.execute('CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)')
        database.execute("INSERT INTO topics VALUES(1, '/odom', 'nav_msgs/msg/Odometry', 'cdr')")
        database.execute(f'CREATE {messages}')
        if data:
            database.execute('INSERT INTO messages VALUES(1, 1, 1, ?)', (data,))
    database.close()
    return path


def write_metadata(folder, name, mode):
    information = {'relative_file_paths': [name], 'compression_mode': mode, 'compression_format': 'zstd'}
    (folder / 'metadata.yaml').write_text(json.dumps({'rosbag2_bagfile_information': information}))
    return folder


def png_of_zeros(width, height):
    """A greyscale image of one byte each row, repeated by the compression."""

    def part(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))

    compressor = zlib.compressobj(9)
    rows = [compressor.compress(bytes(width + 1)) for _ in range(height)]
    head = struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)
    return (
        b'\x89PNG\r\n\x1a\n'
        + part(b'IHDR', head)
        + part(b'IDAT', b''.join(rows) + compressor.flush())
        + part(b'IEND', b'')
    )
