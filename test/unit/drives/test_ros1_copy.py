"""A copy for rosbag play has the same messages, of whichever bag it is."""

import sqlite3

import pytest
from rosbags.highlevel import AnyReader

from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.ros1_copy import write_ros1_copy
from reencoding_drives import ROS1, ROS2, drive, write_ros1, write_ros2

TOPICS = ('/joint_states', '/world_pose')


def copied(path, topics=TOPICS, **options):
    """[(topic, time, message without the seq of its header)]"""
    copy = path.parent / 'copy.bag'
    with open_source(path) as source:
        write_ros1_copy(copy, source, topics, **options)
    with AnyReader([copy]) as reader:
        return [(connection.topic, time_ns, bytes(raw)[4:]) for connection, time_ns, raw in reader.messages()]


def original():
    return [(topic, time_ns, ROS1.raw(message)[4:]) for topic, time_ns, message in drive()]


@pytest.mark.parametrize('of_ros2', [False, True])
def test_every_message_is_in_the_copy(tmp_path, of_ros2):
    path = write_ros2(tmp_path / 'a', drive(ROS2)) if of_ros2 else write_ros1(tmp_path / 'a.bag', drive())
    assert sorted(copied(path)) == sorted(original())


def test_the_last_message_of_the_wheels_can_be_there_again_after_all_others(tmp_path):
    found = copied(write_ros1(tmp_path / 'a.bag', drive()), again_after_ns=5)
    *others, (topic, time_ns, content) = found
    assert sorted(others) == sorted(original())
    last = [(time_ns, content) for topic, time_ns, content in others if topic == '/joint_states'][-1]
    assert (topic, content) == ('/joint_states', last[1]) and time_ns == max(time_ns for _, time_ns, _ in others) + 5


def test_other_topics_are_left_out(tmp_path):
    found = copied(write_ros1(tmp_path / 'a.bag', drive()), TOPICS[:1])
    assert {topic for topic, _, _ in found} == {'/joint_states'} and len(found) == 501


def test_a_torn_message_is_left_out(tmp_path):
    path = write_ros2(tmp_path / 'a', drive(ROS2))
    with sqlite3.connect(str(next(path.glob('*.db3')))) as database:
        database.execute('UPDATE messages SET data = substr(data, 1, 20) WHERE id IN (3, 5)')
    database.close()
    found = copied(path)
    assert len(found) == len(original()) - 2 and set(found) < set(original())
