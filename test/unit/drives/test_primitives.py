"""The parts of messages, as bytes."""

import numpy as np

from diff_encoder_sim.drives.wire import (
    encode_array,
    encode_header,
    encode_names,
    encode_numbers,
    encode_sequence,
    encode_text,
    encode_time,
    with_seq,
)


def test_sequences_follow_their_length_in_little_endian():
    assert encode_text('ä') == b'\x02\0\0\0\xc3\xa4'
    assert encode_sequence([b'a', b'bc']) == b'\x02\0\0\0abc'
    assert encode_names(('a', '')) == b'\x02\0\0\0' + b'\x01\0\0\0a' + b'\0\0\0\0'
    assert encode_numbers('q', (-1,)) == b'\x01\0\0\0' + b'\xff' * 8
    assert encode_numbers('d', ()) == b'\0\0\0\0'


def test_arrays_are_written_row_by_row():
    cells = np.array([[1, -1], [0, 100]], np.int8)
    assert encode_array(cells, 'i1') == b'\x04\0\0\0\x01\xff\x00\x64'
    assert encode_array(cells.T, 'i1') == b'\x04\0\0\0\x01\x00\xff\x64'
    assert encode_array(np.array([1.0]), '<f4') == b'\x01\0\0\0\0\0\x80\x3f'


def test_times_are_seconds_and_nanoseconds():
    assert encode_time(2_000_000_003) == b'\x02\0\0\0\x03\0\0\0'


def test_the_seq_of_a_header_is_set_and_nothing_else():
    header = encode_header(2_000_000_003, 'map')
    assert with_seq(header + b'rest', 258) == b'\x02\x01\0\0' + header[4:] + b'rest'
