"""Encoded messages go through rospy as those of genpy do, and messages whose stamp cannot be reach no node."""

import contextlib
import io
import math

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import Quaternion, TransformStamped
from rosgraph_msgs.msg import Clock
from rospy.msg import args_kwds_to_message, deserialize_messages, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.message_encoders import encode_clock, encode_joint_state
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.ros import messages as room
from diff_encoder_sim.ros.maps import grid_from_message
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
    assert sent(Clock, encode_clock(7), 42)[4:] == encode_clock(7)  # has no header


def test_received_bytes_come_as_they_are_and_the_class_is_described_as_that_of_the_type():
    buffer, messages, ours = io.BytesIO(), [], room.encoded_class(JointState)
    buffer.write(sent(JointState, ENCODED, 1) + sent(JointState, ENCODED, 2))
    deserialize_messages(buffer, messages, ours)
    assert [(message.content[0], message.content[4:]) for message in messages] == [(1, ENCODED[4:]), (2, ENCODED[4:])]
    assert (ours._type, ours._md5sum, ours._full_text) == (JointState._type, JointState._md5sum, JointState._full_text)


def encoded(stamp_s):
    return encode_joint_state(JointStates(stamp_s * 10**9, (), (), ()))


@pytest.fixture(name='receive')
def fixture_receive(monkeypatch):
    """Sends messages to a subscriber at a time [s] of the clock; returns those that its callback accepts."""

    def receive(contents, now_s=100, refused=None, **options):
        accepted, callbacks = [], []

        def callback(content):
            if content == refused:
                raise InputFault('no robot')
            accepted.append(content)

        monkeypatch.setattr(room, 'subscriber', lambda topic, message_class, callback: callbacks.append(callback))
        monkeypatch.setattr(rospy.Time, 'now', lambda: rospy.Time(now_s))
        room.encoded_subscriber('joint_states', JointState, callback, **options)
        for content in contents:
            callbacks[0](room.encoded_class(JointState)(content))
        return accepted

    return receive


@pytest.mark.parametrize(
    ('now_s', 'possible_s', 'impossible_s', 'options'),
    [
        (100, [1, 99, 110], [111, 2**31, 2**32 - 1], {}),
        (0, [5, 1_800_000_000], [2**31], {}),  # the clock is not known yet
        (100, [101], [102], {'most_ahead_s': 1.0}),
    ],
)
def test_only_messages_with_a_possible_stamp_come_through(receive, caplog, now_s, possible_s, impossible_s, options):
    assert receive(map(encoded, possible_s + impossible_s), now_s, **options) == list(map(encoded, possible_s))
    assert [record.args[0] for record in caplog.records] == ['/joint_states'] * len(impossible_s)


def test_messages_that_are_torn_or_refused_are_dropped_with_a_warning(receive, caplog):
    contents = [b'', encoded(1)[:11], encoded(2), encoded(3)]
    assert receive(contents, refused=encoded(2)) == [encoded(3)]
    assert [record.args[0] for record in caplog.records] == ['/joint_states'] * 3


@pytest.mark.parametrize('is_ending', [True, False])
def test_a_message_that_comes_while_the_node_ends_is_no_traceback(monkeypatch, is_ending):
    publisher = room.Publisher('/nowhere', Header)
    publisher.unregister()
    monkeypatch.setattr(rospy.core, 'is_shutdown_requested', lambda: is_ending)
    with contextlib.nullcontext() if is_ending else pytest.raises(rospy.ROSException):
        publisher.publish(Header())


def test_height_roll_and_pitch_are_dropped():
    tilted = TransformStamped()
    tilted.transform.translation.z = 0.4
    # Yaw 90 degrees after a pitch of 10 degrees, of any length.
    sine, cosine = 2 * math.sin(math.radians(5)), 2 * math.cos(math.radians(5))
    tilted.transform.rotation = Quaternion(-sine, sine, cosine, cosine)
    assert room.pose_from_transform(tilted) == pytest.approx((0.0, 0.0, math.pi / 2))


@pytest.mark.parametrize(
    'changes', [dict(width=2), dict(width=0, height=0), dict(resolution=0.0), dict(resolution=math.nan)]
)
def test_what_is_no_map_is_refused(changes):
    message = room.map_message(OccupancyGrid(np.zeros((2, 3), np.int8), 0.05, IDENTITY), 5, 'map')
    for name, value in changes.items():
        setattr(message.info, name, value)
    with pytest.raises(InputFault):
        grid_from_message(message)
