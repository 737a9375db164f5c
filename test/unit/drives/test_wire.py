"""Serialized parts of messages: primitives, covariances, and fields that are read one after the other."""

import struct

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.wire import (
    FieldReader,
    encode_amcl_covariance,
    encode_array,
    encode_header,
    encode_names,
    encode_numbers,
    encode_odometry_covariance,
    encode_sequence,
    encode_text,
    encode_time,
    encode_twist_covariance,
    with_seq,
)
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import TwistCovariance
from reencoding_drives import MAKERS


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


PLANAR = PlanarCovariance(*range(1, 7))
TWIST = TwistCovariance(1.0, 2.0, 3.0)


def matrix(raw):
    return np.frombuffer(raw, '<f8').reshape(6, 6)


def test_x_y_and_yaw_are_the_first_the_second_and_the_last_axis():
    for raw in (encode_amcl_covariance(PLANAR.matrix()), encode_odometry_covariance(PLANAR)):
        assert np.array_equal(matrix(raw)[np.ix_([0, 1, 5], [0, 1, 5])], PLANAR.matrix())
    assert np.array_equal(matrix(encode_twist_covariance(TWIST))[np.ix_([0, 5], [0, 5])], TWIST.matrix())


def test_what_wheels_do_not_measure_is_unknown_and_of_amcl_zero():
    assert np.diag(matrix(encode_odometry_covariance(PLANAR))).tolist() == [1.0, 4.0, 1e12, 1e12, 1e12, 6.0]
    assert np.diag(matrix(encode_twist_covariance(TWIST))).tolist() == [1.0, 1e12, 1e12, 1e12, 1e12, 3.0]
    assert np.diag(matrix(encode_amcl_covariance(PLANAR.matrix()))).tolist() == [1.0, 4.0, 0.0, 0.0, 0.0, 6.0]


@pytest.mark.parametrize(
    ('raw', 'axes'),
    [
        (encode_amcl_covariance(PLANAR.matrix()), [0, 1, 5]),
        (encode_odometry_covariance(PLANAR), [0, 1, 5]),
        (encode_twist_covariance(TWIST), [0, 5]),
    ],
)
def test_nothing_else_is_correlated(raw, axes):
    elsewhere = matrix(raw).copy()
    elsewhere[np.ix_(axes, axes)] = 0.0
    assert not (elsewhere - np.diag(np.diag(elsewhere))).any()


@MAKERS
def test_a_header_and_a_text_with_letters_beyond_ascii(maker):
    fields = FieldReader(maker.raw(maker.transform(7_000_000_009, IDENTITY, 'größer', 'räder')), maker.is_ros2)
    assert fields.header() == (7_000_000_009, 'größer')
    assert fields.text() == 'räder'


def test_numbers_are_aligned_in_cdr_alone():
    raw = b'\0\1\0\0' + b'\x2a\0\0\0' + b'\0\0\0\0' + struct.pack('<d', 1.5)
    fields = FieldReader(raw, is_cdr=True)
    assert fields.length() == 42
    assert fields.unpack(struct.Struct('<d'), 8) == (1.5,)
    packed = FieldReader(raw[4:8] + raw[12:], is_cdr=False)
    assert (packed.length(), packed.unpack(struct.Struct('<d'), 8)) == (42, (1.5,))


def test_bytes_that_are_not_utf_8_are_replaced_unless_refused():
    raw = b'\x02\0\0\0a\xff'
    assert FieldReader(raw, is_cdr=False).text() == 'a\ufffd'
    with pytest.raises(UnicodeDecodeError):
        FieldReader(raw, is_cdr=False).text('strict')


@pytest.mark.parametrize('raw', [b'', b'\0', b'\0\0\0\0', b'\1\0\0\0'])
def test_a_foreign_byte_order_is_a_fault(raw):
    with pytest.raises(InputFault, match='not little-endian CDR'):
        FieldReader(raw, is_cdr=True)


def test_wherever_it_is_torn_it_is_a_fault():
    raw = encode_header(5, 'map') + encode_text('odom')
    for size in range(len(raw)):
        fields = FieldReader(raw[:size], is_cdr=False)
        with pytest.raises(InputFault, match='torn'):
            (fields.header(), fields.text())
