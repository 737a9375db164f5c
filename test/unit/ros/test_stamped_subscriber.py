"""Messages whose stamp cannot be do not reach a node."""

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from diff_encoder_sim.ros import encoded_topics as room


@pytest.fixture(name='receive')
def fixture_receive(monkeypatch):
    """Sends messages with given stamps [s] at a time [s] of the clock; returns the stamps that reach the node."""

    def receive(now_s, *stamps_s, **options):
        taken, callbacks = [], []
        monkeypatch.setattr(room, 'subscriber', lambda topic, message_class, callback: callbacks.append(callback))
        monkeypatch.setattr(rospy.Time, 'now', lambda: rospy.Time(now_s))
        room.stamped_subscriber('joint_states', JointState, taken.append, **options)
        for stamp_s in stamps_s:
            callbacks[0](JointState(header=Header(stamp=rospy.Time(stamp_s))))
        return [message.header.stamp.secs for message in taken]

    return receive


def test_only_messages_with_a_possible_stamp_come_through(receive, caplog):
    assert receive(100, 1, 99, 110, 111, 2**31, 2**32 - 1) == [1, 99, 110]
    assert [record.args[0] for record in caplog.records] == ['/joint_states'] * 3
    assert 'stamp 111.000 s is 11.0 s ahead of the clock' in caplog.records[0].getMessage()


def test_before_the_clock_is_known_only_what_tf_cannot_hold_is_dropped(receive):
    assert receive(0, 5, 1_800_000_000, 2**31) == [5, 1_800_000_000]


def test_a_node_may_allow_less(receive):
    assert receive(100, 101, 102, most_ahead_s=1.0) == [101]


def test_a_message_is_too_far_ahead_only_of_a_clock_that_was_read_again(receive, monkeypatch, caplog):
    """Between two looks at the clock, a second may pass at many times real time."""
    monkeypatch.setattr(room, 'wait_for_clock', lambda: monkeypatch.setattr(rospy.Time, 'now', lambda: rospy.Time(105)))
    assert receive(100, 101, 105, most_ahead_s=1.0) == [101, 105]
    assert not caplog.records
