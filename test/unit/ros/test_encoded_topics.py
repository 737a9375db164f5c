"""Encoded messages go through rospy as those of genpy do."""

import io

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
from rosgraph_msgs.msg import Clock
from rospy.msg import args_kwds_to_message, deserialize_messages, serialize_message
from sensor_msgs.msg import JointState

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.sensor_messages import encode_clock, encode_joint_state
from diff_encoder_sim.ros import encoded_topics as room
from diff_encoder_sim.simulation.state import JointStates

ENCODED = encode_joint_state(JointStates(5_000_000_007, ('left', 'right'), (1.5, -2.0), (0.1, 0.2)))


def sent(message_class, content, seq):
    """What rospy writes to the sockets of the subscribers."""
    message = args_kwds_to_message(message_class, (room.encoded_class(message_class)(content),), {})
    buffer = io.BytesIO()
    serialize_message(buffer, seq, message)
    return buffer.getvalue()


def test_a_message_with_a_header_is_numbered_by_rospy_as_one_of_genpy_is():
    message, expected = JointState().deserialize(ENCODED), io.BytesIO()
    serialize_message(expected, 42, message)
    assert sent(JointState, ENCODED, 42) == expected.getvalue()


def test_a_message_without_a_header_stays_as_it_is():
    assert sent(Clock, encode_clock(7), 42)[4:] == encode_clock(7)


def test_the_class_is_described_to_other_nodes_as_that_of_the_type():
    ours = room.encoded_class(JointState)
    assert (ours._type, ours._md5sum, ours._full_text) == (JointState._type, JointState._md5sum, JointState._full_text)


def test_received_bytes_come_as_they_are():
    buffer, messages = io.BytesIO(), []
    buffer.write(sent(JointState, ENCODED, 1) + sent(JointState, ENCODED, 2))
    deserialize_messages(buffer, messages, room.encoded_class(JointState))
    assert [message.content[4:] for message in messages] == [ENCODED[4:]] * 2
    assert [message.content[0] for message in messages] == [1, 2]


@pytest.fixture(name='receive')
def fixture_receive(monkeypatch):
    """Sends contents at 100 s; returns those that reach the node, which refuses one that begins as `refused`."""

    def receive(*contents, refused=None):
        taken, callbacks = [], []

        def take(content):
            if content == refused:
                raise InputFault('no robot')
            taken.append(content)

        monkeypatch.setattr(room, 'subscriber', lambda topic, message_class, callback: callbacks.append(callback))
        monkeypatch.setattr(rospy.Time, 'now', lambda: rospy.Time(100))
        room.encoded_stamped_subscriber('joint_states', JointState, take)
        for content in contents:
            callbacks[0](room.encoded_class(JointState)(content))
        return taken

    return receive


def stamped(stamp_s):
    return encode_joint_state(JointStates(stamp_s * 10**9, (), (), ()))


def test_only_messages_with_a_possible_stamp_come_through(receive, caplog):
    possible = [stamped(stamp_s) for stamp_s in (1, 99, 110)]
    assert receive(*possible, stamped(111), stamped(2**31)) == possible
    assert [record.args[0] for record in caplog.records] == ['/joint_states'] * 2
    assert 'stamp 111.000 s is 11.0 s ahead of the clock' in caplog.records[0].getMessage()


def test_what_is_torn_or_refused_is_dropped_with_a_warning(receive, caplog):
    assert receive(b'', stamped(1)[:11], stamped(2), stamped(3), refused=stamped(2)) == [stamped(3)]
    dropped = '/joint_states: message dropped: a message is torn'
    assert [record.getMessage() for record in caplog.records] == [dropped] * 2 + [
        '/joint_states: no robot; message dropped'
    ]
