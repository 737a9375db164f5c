"""Bags whose messages are sound and whose container is not: damage, odd records, odd tables, bombs."""

import bz2
import contextlib
import io
import struct

import lz4.frame

import bag_bombs as bombs
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.cli.map_bag import main as map_bag
from diff_encoder_sim.cli.reencode import main as reencode
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.bounded_decompression import decompressed, open_zstd
from diff_encoder_sim.drives.message_types import LASER_SCAN, ODOMETRY, TRANSFORMS
from diff_encoder_sim.drives.ros1_copy import write_ros1_copy
from diff_encoder_sim.drives.ros1_stream import MAGIC as ROS1_MAGIC
from diff_encoder_sim.drives.ros1_stream import header_fields, read_data
from diff_encoder_sim.drives.serving_topics import serving_options
from diff_encoder_sim.drives.wire import LENGTH, UINT64
from fuzz_bags import good_drive
from odd_values import damaged, pick
from reencoding_drives import COMPRESSIONS, ROS1, ROS2, without_index, write_ros1, write_ros2

LENGTHS = (0, 1, 7, 8, 2**16, 2**24 + 1, 2**27, 2**27 + 1, 2**31 - 1, 2**31, 2**32 - 1)
LONG_LENGTHS = (*LENGTHS, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 1)
NAMES = ('', 'none', 'bz2', 'lz4', 'zstd', 'gzip', 'ä', 'x' * 5000, '\0', 'BZ2', 'none ')
COMPRESSORS = {'none': bytes, '': bytes, 'bz2': bz2.compress, 'lz4': lz4.frame.compress, 'zstd': bombs.zstd}
LINE = '\n' + 80 * '=' + '\n'
DEFINITIONS = (
    '',
    'string[100000000] x',
    LINE.join(['p/T0[100] x', *(f'MSG: p/T{n}\np/T{n + 1}[100] x' for n in range(6)), 'MSG: p/T6\nuint8 x']),
    f'p/E[] x{LINE}MSG: p/E\n',
    'float64[999999999999999999999999] x',
    'uint8 class\n',
    '\0' * 100,
    'x ' * 100_000,
)
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
PPR = ('--ppr', '40')
COPIED = (LASER_SCAN, ODOMETRY, TRANSFORMS)

_good = {}  # kind -> {path: content}


def warm_up(folder):
    for compression in COMPRESSIONS:
        _keep(f'ros1 {compression}', write_ros1(folder / f'{compression}.bag', good_drive(ROS1), compression))
    for plugin, modes in (('mcap', ('NONE', 'STORAGE')), ('sqlite3', ('NONE', 'MESSAGE', 'FILE'))):
        for mode in modes:
            _keep(f'{plugin} {mode}', write_ros2(folder / f'{plugin}{mode}', good_drive(ROS2), plugin, mode))
    for kind in ('ros1 None', 'sqlite3 NONE'):
        path = _write(folder / kind.replace(' ', '_'), _good[kind])
        for use in USES:
            out = folder / f'{kind} {use.__name__}'
            out.mkdir()
            use(path, out)


def run(rng, folder):
    files = dict(_good[pick(rng, list(_good))])
    name = max(files, key=lambda each: len(files[each]))
    if len(files) > 1 and rng.random() < 0.15:
        name = pick(rng, sorted(files))
    files[name] = _mutant(rng, files[name], folder)
    path = _write(folder / 'odd', files)
    if path.is_dir() and rng.random() < 0.3:  # the file by itself
        path = path / name
    pick(rng, USES)(path, folder)


def _keep(kind, path):
    paths = sorted(path.iterdir()) if path.is_dir() else [path]
    _good[kind] = {each.name: each.read_bytes() for each in paths}


def _write(folder, files):
    folder.mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder if len(files) > 1 else folder / next(iter(files))


def _mutant(rng, content, folder):
    if content.startswith(ZSTD_MAGIC) and rng.random() < 0.7:
        return bombs.zstd(_mutant(rng, open_zstd(io.BytesIO(content)).read(), folder))
    if rng.random() < 0.6:
        for magic, mutate in ODD_OF_KIND.items():
            if content.startswith(magic):
                return mutate(rng, content, folder)
    return _with_damage(rng, content)


def _with_damage(rng, content):
    for _ in range(int(rng.integers(1, 4))):
        content = pick(rng, DAMAGES)(rng, content or b'x')
    return content


# How a bag is used


def _reencode(path, folder):
    reencode([str(path), '--ppr', '40', '1024', '--out', str(folder / 'what_if')])


def _reencode_fields(path, folder):
    del folder
    reencode([str(path), '--ticks', '/odom.pose.pose.position.x', '/odom.pose.pose.position.y', '--unit', 'm', *PPR])


def _reencode_frames(path, folder):
    del folder
    reencode([str(path), '--odom', '/odom', '--reference', '/world_pose', *PPR])


def _list_what_could_serve(path, folder):
    """Every topic's definition is read."""
    del folder
    with open_source(path) as source:
        serving_options(path, source)


def _map(path, folder):
    map_bag([str(path), '-f', str(folder / 'map')])


def _copy(path, folder):
    with open_source(path) as source:
        topics = [topic for topic, kind in source.topics.items() if kind in COPIED]
        write_ros1_copy(folder / 'copy.bag', source, topics)


USES = (_reencode, _reencode_fields, _reencode_frames, _list_what_could_serve, _map, _copy)


# Of any file


def _flipped(rng, content):
    content = bytearray(content)
    at = int(rng.integers(len(content) or 1))
    for place in (at + rng.integers(-200, 200, int(rng.integers(1, 30)))) if rng.random() < 0.5 else [at]:
        content[int(place) % len(content)] ^= 1 << int(rng.integers(8))
    return bytes(content)


def _filled(rng, content):
    at, length = int(rng.integers(len(content) or 1)), int(2 ** rng.uniform(0, 18))
    return content[:at] + pick(rng, (b'\0', b'\0', b'\xff')) * length + content[at + length :]


def _cut(rng, content):
    return content[: int(rng.integers(len(content) or 1))]


def _with_tail(rng, content):
    tail = pick(rng, (b'\0', b'\0', b'\0', b'\xff', b'\x01\0\0\0x\0\0\0\0', b'\x08\0\0\0\4\0\0\0op=\4\0\0\0\0'))
    return content + tail * (int(2 ** rng.uniform(4, 25)) // len(tail))


def _doubled(rng, content):
    at, to = sorted(int(each) for each in rng.integers(0, len(content) + 1, 2))
    return content[:to] + content[at:to] + content[to:]


def _without(rng, content):
    at, length = int(rng.integers(len(content) or 1)), int(2 ** rng.uniform(0, 16))
    return content[:at] + content[at + length :]


def _odd_number_in(rng, content):
    """Replace a length at its usual place: before or after a short text, or anywhere."""
    marks = (
        b'op=',
        b'conn=',
        b'size=',
        b'compression=',
        b'index_pos=',
        b'conn_count=',
        b'chunk_count=',
        b'\x05',
        b'\x06',
    )
    mark = pick(rng, marks)
    found = [at for at in range(len(content)) if content.startswith(mark, at)] if len(content) < 200_000 else []
    at = (pick(rng, found) + pick(rng, (-8, -4, len(mark)))) if found else int(rng.integers(len(content) or 1))
    at = max(at, 0)
    size, value = pick(rng, ((struct.Struct('<I'), LENGTHS), (UINT64, LONG_LENGTHS)))
    number = size.pack(int(pick(rng, value)))
    return content[:at] + number + content[at + len(number) :]


DAMAGES = (*(_flipped, _filled, _cut, _with_tail, _doubled, _without, _odd_number_in, _odd_number_in), damaged)


# Of ROS 1


def _odd_ros1(rng, content, folder):
    del folder
    if rng.random() < 0.3:
        return _with_ros1_bomb(rng, content)
    file = io.BytesIO(content[len(ROS1_MAGIC) :])
    found = []
    while True:
        header, data = read_data(file), read_data(file)
        if not header or data is None:
            break
        found.append([dict(header_fields(header)), data])
    for _ in range(int(rng.integers(1, 4))):
        index = int(rng.integers(len(found)))
        pick(rng, (_odd_ros1_field, _odd_ros1_field, _odd_ros1_data, _odd_ros1_data, _odd_order))(rng, found, index)
    return ROS1_MAGIC + b''.join(_ros1_record(*each) for each in found)


def _odd_ros1_field(rng, found, index):
    fields = found[index][0]
    name = pick(rng, sorted(fields) or [b'op'])
    value = fields.pop(name, b'')
    odd = (
        b'',
        value + b'\0',
        value[:-1],
        b'\xff' * 8,
        b'\0' * 4,
        bytes(rng.bytes(8)),
        *(text.encode() for text in NAMES),
    )
    if rng.random() < 0.8:
        fields[pick(rng, (name, name, name, b'', name + b'=', b'oq'))] = pick(rng, odd)


def _odd_ros1_data(rng, found, index):
    """Change a chunk beneath its compression, or the description of a connection."""
    fields, data = found[index]
    if fields.get(b'op') != b'\x05':
        described = dict(header_fields(data))
        if b'message_definition' in described and rng.random() < 0.7:
            described[b'message_definition'] = pick(rng, DEFINITIONS).encode()
            data = b''.join(_ros1_field(*each) for each in described.items())
        found[index][1] = data if b'message_definition' in described else _with_damage(rng, data or b'x')
        return
    compression = fields.get(b'compression', b'none').decode('utf-8', 'replace')
    with contextlib.suppress(InputFault):
        data = _with_damage(rng, decompressed(compression, data))
    fields[b'size'] = LENGTH.pack(len(data) if rng.random() < 0.8 else int(pick(rng, LENGTHS)))
    found[index][1] = COMPRESSORS.get(compression, bytes)(data)


def _odd_order(rng, found, index):
    action = int(rng.integers(4))
    if action == 0:
        found.insert(int(rng.integers(len(found))), found[index])
    elif action == 1 and len(found) > 1:
        del found[index]
    elif action == 2:
        found.append([{}, b''])
    else:
        found.extend(found[:])


def _with_ros1_bomb(rng, content):
    compression, bomb = pick(
        rng, (('bz2', bombs.BZ2_OF_TWO_GB), ('lz4', bombs.lz4_of_zeros(1 << 27)), ('none', bytes(9)))
    )
    chunk = bombs.ros1_chunk(compression, bomb, int(pick(rng, (*LENGTHS, 1 << 27))))
    if rng.random() < 0.3:  # still being written
        at = len(chunk) - len(bomb) - 4
        chunk = chunk[:at] + bytes(4) + chunk[at + 4 :]
    return without_index(content) + chunk * int(pick(rng, (1, 1, 5, 300 if len(chunk) < 10_000 else 5)))


def _ros1_field(name, value):
    return LENGTH.pack(len(name) + 1 + len(value)) + name + b'=' + value


def _ros1_record(fields, data):
    header = b''.join(_ros1_field(*each) for each in fields.items())
    return LENGTH.pack(len(header)) + header + LENGTH.pack(len(data)) + data


# Of MCAP


ODD_OF_KIND = {ROS1_MAGIC: _odd_ros1}
