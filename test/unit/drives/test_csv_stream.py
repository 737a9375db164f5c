"""Rows of a CSV file as messages."""

import os

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.csv_wheels import PAIR, CsvStream


def stream_of(tmp_path, content, columns=('1', '2', '3'), time_unit='s'):
    path = tmp_path / 'a.csv'
    path.write_bytes(content)
    return CsvStream(path, columns, time_unit)


def rows_of(stream):
    return [(message.time_ns, *PAIR.unpack(message.raw)) for message in stream.messages(())]


def test_rows_come_as_often_as_they_are_asked_for(tmp_path):
    stream = stream_of(tmp_path, b'\xef\xbb\xbft,l,r\r\n1,2,3\r\n\r\n# a remark\r\n2,3,4\r\n', ('t', 'l', 'r'))
    assert rows_of(stream) == rows_of(stream) == [(10**9, 2.0, 3.0), (2 * 10**9, 3.0, 4.0)]
    assert stream.fault == '' and list(stream.topics) == ['a.csv']


def test_bad_rows_are_named_by_their_lines(tmp_path):
    lines = [b't,l,r'] + [b'%d,1,2' % number for number in range(2, 101)]
    for number in (7, 20, 33, 50, 51, 52, 99):
        lines[number - 1] = b'oops'
    stream = stream_of(tmp_path, b'\n'.join(lines))
    assert len(rows_of(stream)) == 92
    assert stream.fault.startswith('7 bad rows, in lines 7, 20, 33, 50, 51, ...; the first: 1 columns; expected 3')


def test_a_file_without_ends_of_lines_is_not_read_at_once(tmp_path):
    stream = stream_of(tmp_path, b'1,2,3\n' * 60 + b'9' * 1_000_000)
    assert len(rows_of(stream)) == 60
    assert stream.fault.startswith('100 bad rows, in lines 61')


@pytest.mark.parametrize('content', [b'', b'\0\xff\n' * 20, b'prose'])
def test_what_is_no_table_is_refused(tmp_path, content):
    with pytest.raises(ConfigError, match=r'^/.*a\.csv: no table'):
        stream_of(tmp_path, content)


def test_what_cannot_be_read_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r'none\.csv: cannot be read: No such file'):
        CsvStream(tmp_path / 'none.csv', ('1', '2', '3'), 's')


def test_what_cannot_be_read_twice_is_refused(tmp_path):
    """A pipe would end, or give the rest, when it is read again."""
    os.mkfifo(tmp_path / 'pipe')
    for path in (tmp_path, tmp_path / 'pipe'):
        with pytest.raises(ConfigError, match='given no regular file'):
            CsvStream(path, ('1', '2', '3'), 's')
