"""Fields one after the other, of ROS 1 and of CDR."""

import struct

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.wire import FieldReader, encode_header, encode_text
from reencoding_drives import MAKERS


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
