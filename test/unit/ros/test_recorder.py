"""The bag of a live trial: rosbag reads what came, in the order of its times."""

import pytest
import rosbag
from std_msgs.msg import String

from diff_encoder_sim.drives.message_encoders import encode_string
from diff_encoder_sim.ros.recorder import RecordedBag


def publisher(node, latching='0'):
    header = dict(type=String._type, md5sum=String._md5sum, message_definition=String._full_text)
    return {'callerid': node, 'latching': latching, **header}


def record(path, messages, chunk_threshold=1 << 20):
    bag = RecordedBag(path)
    bag.chunk_threshold = chunk_threshold
    for topic, header, time_ns, text in messages:
        bag.record(topic, header, time_ns, encode_string(text))
    bag.close()


# In a chunk also what came after a reset; rosbag does not sort over chunks.
@pytest.mark.parametrize(('chunk_threshold', 'reset_after'), [(100, 1000), (1 << 20, 40)])
def test_rosbag_reads_what_was_recorded(tmp_path, chunk_threshold, reset_after):
    one, other = publisher('/one'), publisher('/other', latching='1')
    # A node that connects anew has a header of its own.
    messages = [('/a', (one, other, dict(one))[i % 3], 1 + (7 * i) % reset_after, f'text {i}' * 20) for i in range(60)]
    record(tmp_path / 'trial.bag', messages, chunk_threshold)
    with rosbag.Bag(str(tmp_path / 'trial.bag')) as bag:
        read = [(topic, time.to_nsec(), message.data) for topic, message, time in bag.read_messages()]
        assert sorted(read) == sorted((topic, time_ns, text) for topic, _, time_ns, text in messages)
        assert [time_ns for _, time_ns, _ in read] == sorted(time_ns for _, _, time_ns, _ in messages)
        assert bag.get_compression_info().compression == 'lz4'
        headers = {(each.header['callerid'], each.header['latching']) for each in bag._get_connections()}
        assert headers == {(b'/one', b'0'), (b'/other', b'1')}


def test_what_a_killed_recorder_left_is_replaced(tmp_path):
    path = tmp_path / 'trial.bag'
    path.write_bytes(b'torn')
    record(path, [('/a', publisher('/one'), 5, 'new')])
    with rosbag.Bag(str(path)) as bag:
        assert bag.get_message_count() == 1
