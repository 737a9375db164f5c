"""Drives in CSV files: delimiters, headers and numbers, and rows as messages."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.drives.csv_table import CsvStream, CsvWheels, find_format
from diff_encoder_sim.drives.wheel_source import WheelNumbers


@pytest.mark.parametrize(
    'rows',
    [
        ['0.5,10,-1.5', '1.5,11,-2.5'],
        ['0.5;10;-1.5', '1.5;11;-2.5'],
        ['0,5;10;-1,5', '1,5;11;-2,5'],
        ['0.5\t10\t-1.5', '1.5\t11\t-2.5'],
        ['0.5|10|-1.5', '1.5|11|-2.5'],
        ['# two lines', '# of a remark', '  0.5  10 -1.5', '1.5 11   -2.5'],
        ['"0.5", "10" ,"-1.5"', "'1.5','11','-2.5'"],
    ],
)
def test_the_delimiter_is_found(rows):
    found = find_format(rows, ('1', '3', '2'), 's')
    assert not found.has_header
    assert [found.numbers(row) for row in rows[-2:]] == [(500_000_000, [-1.5, 10.0]), (1_500_000_000, [-2.5, 11.0])]


@pytest.mark.parametrize(
    ('lines', 'columns', 'has_header'),
    [
        (['time,left,right', '1,2,3'], ('time', 'left', 'right'), True),
        (['# a drive', '#t [ns],left ticks,right ticks', '1,2,3'], ('t [ns]', 'left ticks', '3'), False),
        (['"t";"l";"r"', '1;2;3'], ('t', 'l', 'r'), True),
    ],
)
def test_columns_are_found_by_name(lines, columns, has_header):
    found = find_format(lines, columns, 's')
    assert (found.columns, found.has_header) == ((0, 1, 2), has_header)


def test_times_are_exact():
    texts = '1524211207123456789 ns', '1524211207.123456789 s', '1524211207123456.789 us', '1524211207123.456789e0 ms'
    for text, unit in map(str.split, texts):
        assert find_format(['1,2,3'], '123', unit).numbers(f'{text},0,0')[0] == 1524211207123456789


@pytest.mark.parametrize('row', ['', '1,2', 'x,2,3', '1,2,nan', '1,2,1e999', '-1,2,3', '1e9999999,2,3', '7_0,2,3'])
def test_a_bad_row_is_refused(row):
    with pytest.raises(InputFault, match='expected'):
        find_format(['1,2,3'], '123', 's').numbers(row)


@pytest.mark.parametrize(
    ('lines', 'columns', 'complaint'),
    [
        (['a,b,c', '1,2,3'], 'abd', 'given d; allowed: a number from 1 to 3 or a name: a, b, c'),
        (['1,2,3'], 'a23', 'given a; allowed: a number from 1 to 3; the file has no header'),
        (['a,b,c', '1,2,3'], 'ab2', 'given a b 2; allowed: columns that differ'),
        (['1,2', '3,4'], '123', 'no table; expected 3 or more columns'),
    ],
)
def test_missing_columns_are_named(lines, columns, complaint):
    with pytest.raises(ConfigError, match=complaint):
        find_format(lines, columns, 's')


def stream_of(tmp_path, content, columns='123'):
    (tmp_path / 'a.csv').write_bytes(content)
    return CsvStream(tmp_path / 'a.csv', columns, 's')


def rows_of(stream):
    wheels = CsvWheels(stream.topic, ('l', 'r'), WheelNumbers('rad', (0.1, 0.1)))
    for message in stream.messages(stream.topics):
        wheels.add(message)
    [(drive, times_ns)] = wheels.drives()
    assert np.array_equal(drive.stamps_ns, times_ns)
    return [(stamp_ns, *pair) for stamp_ns, pair in zip(times_ns.tolist(), drive.wheel_angles_rad.tolist())]


def test_rows_can_be_read_several_times(tmp_path):
    stream = stream_of(tmp_path, b'\xef\xbb\xbft,l,r\r\n1,2,3\r\n\r\n# a remark\r\n2,3,4\r\n', 'tlr')
    assert rows_of(stream) == rows_of(stream) == [(10**9, 2.0, 3.0), (2 * 10**9, 3.0, 4.0)]
    assert stream.fault == '' and list(stream.topics) == ['a.csv']


def test_bad_rows_are_named_by_their_lines(tmp_path):
    lines = [b't,l,r'] + [b'%d,1,2' % number for number in range(2, 101)]
    for number in (7, 20, 33, 50, 51, 52, 99):
        lines[number - 1] = b'oops'
    stream = stream_of(tmp_path, b'\n'.join(lines))
    assert len(rows_of(stream)) == 92
    assert stream.fault.startswith('7 bad rows, in lines 7, 20, 33, 50, 51, ...; the first: 1 columns; expected 3')


def test_other_files_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r'^/.*a\.csv: no table'):
        stream_of(tmp_path, b'\0\xff\n' * 20)
