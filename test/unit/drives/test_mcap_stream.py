"""MCAP files as streams: with and without index, torn, damaged, and of other encodings."""

import pytest

from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.mcap_records import MAGIC, Opcode, encode_record
from diff_encoder_sim.drives.mcap_stream import McapStream
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.wire import LENGTH, UINT16, encode_text
from recorded_messages import one_of_each

TOPICS = topics.RECORDED


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """A file of two chunks and more."""
    path = tmp_path_factory.mktemp('whole') / 'a.mcap'
    with TrialBag(path, 'full', 'mcap') as bag:
        for time_ns in range(1, 200):
            for topic, node, message in one_of_each():
                bag.write(topic.name, node, message, time_ns)
    return path


def read(path):
    stream = McapStream(path)
    return list(stream.messages(TOPICS)), stream.fault


def test_a_topic_again_and_again(whole):
    stream = McapStream(whole)
    for _ in range(2):
        assert {message.topic for message in stream.messages(['/odom'])} == {'/odom'}
    assert stream.definitions['std_msgs/msg/String'] == 'string data\n'


def test_without_index_all_is_read(whole, tmp_path):
    content = whole.read_bytes()
    path = tmp_path / 'a.mcap'
    path.write_bytes(content[: content.index(encode_record(Opcode.DATA_END, LENGTH.pack(0)))])
    messages, fault = read(path)
    assert messages == read(whole)[0] and fault == 'no index, as after a crash'


def test_wherever_it_is_torn_its_beginning_is_read(whole, tmp_path):
    content, (messages, _) = whole.read_bytes(), read(whole)
    path, counts = tmp_path / 'a.mcap', []
    for size in range(len(MAGIC), len(content), len(content) // 50):
        path.write_bytes(content[:size])
        found, fault = read(path)
        assert fault and found == messages[: len(found)]
        counts.append(len(found))
    assert counts == sorted(counts) and counts[-1] == len(messages) > counts[len(counts) // 2] > 0


def test_a_chunk_with_a_changed_byte_is_left_out(whole, tmp_path):
    content, (messages, _) = bytearray(whole.read_bytes()), read(whole)
    content[content.index(b'base_link') + 2] ^= 1
    path = tmp_path / 'a.mcap'
    path.write_bytes(bytes(content))
    found, fault = read(path)
    assert 0 < len(found) < len(messages) and 'does not have its checksum' in fault


def test_what_is_not_cdr_is_left_out_and_named(tmp_path):
    schema = UINT16.pack(1) + encode_text('foo.Bar') + encode_text('protobuf') + encode_text('')
    channel = UINT16.pack(1) * 2 + encode_text('/bar') + encode_text('protobuf') + LENGTH.pack(0)
    path = tmp_path / 'a.mcap'
    path.write_bytes(MAGIC + encode_record(Opcode.SCHEMA, schema) + encode_record(Opcode.CHANNEL, channel))
    stream = McapStream(path)
    assert stream.topics == {} and stream.fault == "/bar is left out: encoded as 'protobuf'; expected 'cdr'"
