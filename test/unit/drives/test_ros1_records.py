"""Records of a ROS 1 bag."""

import io

from diff_encoder_sim.drives.ros1_stream import header_fields, read_header, records, value_places


def with_length(content):
    return len(content).to_bytes(4, 'little') + content


HEADER = with_length(b'op=\x02') + with_length(b'conn=\x01\x00\x00\x00') + with_length(b'topic=/a=b')


def test_fields_are_found_by_name_whatever_their_values():
    assert header_fields(HEADER) == {b'op': b'\x02', b'conn': b'\x01\x00\x00\x00', b'topic': b'/a=b'}
    assert HEADER[value_places(HEADER)[b'topic'] :] == b'/a=b'


def test_a_header_is_read_as_far_as_it_is_sound():
    assert header_fields(b'') == {}
    assert header_fields(HEADER[:-1]) == {b'op': b'\x02', b'conn': b'\x01\x00\x00\x00'}
    assert header_fields(with_length(b'op=\x02') + with_length(b'nothing')) == {b'op': b'\x02'}


def test_whole_records_are_found_in_a_chunk_that_is_cut_off():
    record = with_length(HEADER) + with_length(b'data')
    for size in range(2 * len(record) + 1):
        found = list(records((record + record)[:size]))
        assert len(found) == size // len(record)
        for header_at, data_at, end in found:
            assert (record + record)[header_at : data_at - 4] == HEADER and (record + record)[data_at:end] == b'data'


def test_a_header_is_none_where_the_file_ends_or_the_length_is_absurd():
    whole = with_length(HEADER)
    assert read_header(io.BytesIO(whole))[b'topic'] == b'/a=b'
    assert all(read_header(io.BytesIO(whole[:size])) is None for size in range(len(whole)))
    assert read_header(io.BytesIO(b'\xff\xff\xff\xff' + HEADER)) is None
