"""Files of ROS 2 as streams: with and without index, torn, damaged, and of other encodings."""

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.ros2_stream import MCAP_MAGIC, McapStream
from diff_encoder_sim.drives.trial_bag import TrialBag
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


def test_the_index_leads_to_every_message(whole):
    messages, fault = read(whole)
    with open(whole, 'rb') as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        found = [(channel.topic, message.log_time, message.data) for _, channel, message in reader.iter_messages()]
    assert fault == '' and len(summary.chunk_indexes) > 1
    assert sorted(found) == sorted(message[:3] for message in messages)
    assert summary.statistics.message_count == len(messages) > 0


def test_a_topic_again_and_again(whole):
    stream = McapStream(whole)
    for _ in range(2):
        assert {message.topic for message in stream.messages(['/odom'])} == {'/odom'}
    assert stream.definitions['std_msgs/msg/String'] == 'string data\n'


def test_wherever_it_is_torn_its_beginning_is_read(whole, tmp_path):
    content, (messages, _) = whole.read_bytes(), read(whole)
    path, counts = tmp_path / 'a.mcap', []
    for size in range(len(MCAP_MAGIC), len(content), len(content) // 20):
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
    assert 0 < len(found) < len(messages) and 'damaged: the chunk' in fault


def test_what_is_not_cdr_is_left_out_and_named(tmp_path):
    path = tmp_path / 'a.mcap'
    with open(path, 'wb') as file:
        writer = Writer(file)
        writer.start()
        writer.register_channel('/bar', 'protobuf', writer.register_schema('foo.Bar', 'protobuf', b''))
        writer.finish()
    stream = McapStream(path)
    assert stream.topics == {} and "encoded as 'protobuf'" in stream.fault
