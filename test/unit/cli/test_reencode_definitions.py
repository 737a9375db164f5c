"""Definitions of messages that a bag has: a few kilobytes of text can mean gigabytes."""

import pytest
from rosbags.rosbag1 import Writer

from reencoding_runs import complaint, run

LINE = '\n' + 80 * '=' + '\n'
TICKS = ['--ticks', '/core.left', '/core.right', '--ticks-per-revolution', '100', '--ppr', '90']


def write_bag(path, definition, raw=bytes(1000)):
    with Writer(path) as writer:
        core = writer.add_connection('/core', 'p/msg/Core', msgdef=definition, md5sum='0' * 32)
        for number in range(1, 4):
            writer.write(core, number * 10**9, raw)
    return path


def nested(field, depth, last):
    """Types of which each is made of the next."""
    parts = [field.format(0), *(f'MSG: p/T{number}\n{field.format(number + 1)}' for number in range(depth))]
    return LINE.join([*parts, f'MSG: p/T{depth}\n{last}\n'])


TOO_LARGE = {
    'strings': 'string[100000000] left',
    'messages': nested('p/T{}[100000000] left', 0, 'uint8 x'),
    'nested arrays': nested('p/T{}[100] left', 8, 'uint8 x'),
    'nested arrays of nothing': nested('p/T{}[100] left', 8, ''),
    'nested fields': nested('p/T{0} left\np/T{0} right', 30, 'uint8 x'),
    'nested fields of nothing': nested('p/T{0} left\np/T{0} right', 30, ''),
    'any number of nothing': nested('p/T{}[] left', 0, ''),
    'any number of nested nothing': LINE.join(['p/T0[] left', 'MSG: p/T0\np/T1 x', 'MSG: p/T1\n']),
    'itself': nested('p/T{} left', 1, 'p/T0 again'),
    'itself in an array': nested('p/T{}[] left', 1, 'p/T0[] again'),
    'chain of types': nested('p/T{} left', 2000, 'uint8 x'),
    'many fields': '\n'.join(f'uint8 field_{number}' for number in range(20_000)),
    'long text': '# nothing\n' * 100_000,
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize('definition', TOO_LARGE.values(), ids=TOO_LARGE)
def test_a_definition_that_means_too_much_is_refused(tmp_path, capsys, definition):
    path = write_bag(tmp_path / 'a.bag', definition)
    text = complaint(capsys, path, *TICKS)
    assert '/core' in text and 'p/msg/Core' in text and 'allowed: at most' in text
    assert '/core' in complaint(capsys, path, '--ppr', '90')  # lists what could serve


UNUSABLE = {
    'array of numbers': f'uint8[{10**30}] a\nuint8 left\nuint8 right',
    'number of 5000 digits': f'uint8[{"9" * 5000}] a\nuint8 left\nuint8 right',
    'keywords': 'uint8 class\nuint8 None\nuint8 left\nuint8 right',
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize('definition', UNUSABLE.values(), ids=UNUSABLE)
def test_a_definition_that_fits_no_message_ends_in_one_line(tmp_path, capsys, definition):
    assert '/core' in complaint(capsys, write_bag(tmp_path / 'a.bag', definition), *TICKS)


@pytest.mark.parametrize('index', ['²', '٣', '9' * 5000, '-1', '1e3'])
def test_an_index_that_is_no_number_ends_in_one_line(tmp_path, capsys, index):
    path = write_bag(tmp_path / 'a.bag', 'uint8[1000] data')
    ticks = ['--ticks', f'/core[{index}]', '/core[1]', '--ticks-per-revolution', '100', '--ppr', '90']
    assert '--ticks' in complaint(capsys, path, *ticks)


def test_large_arrays_of_numbers_are_read(tmp_path, capsys):
    """An image, and 64 tracks of ten numbers."""
    track = '\n'.join(f'float64 x{number}' for number in range(10))
    text = LINE.join(['uint8[921600] image\np/Track[64] tracks\nuint8 left\nuint8 right', f'MSG: p/Track\n{track}'])
    path = write_bag(tmp_path / 'a.bag', text, bytes(921600 + 64 * 80 + 2))
    run(path, *TICKS)
    assert '3 messages of /core.left, /core.right' in capsys.readouterr().out
