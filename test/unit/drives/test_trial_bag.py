"""A trial's bag: what the nodes' connections would be, whole or absent, the same bytes each time."""

import contextlib
import errno
import os
import resource

import pytest
from rosbags.highlevel import AnyReader

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import encode_clock, encode_pose_stamped, encode_scan, encode_string
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_bag import TrialBag, TrialBags
from diff_encoder_sim.drives.trial_definition import Outcome, Trial
from diff_encoder_sim.drives.trial_recording import read_trial
from diff_encoder_sim.drives.typestore import definition
from places import ROOT
from recorded_messages import MAP_POSE, ODOM_POSE, SCAN, one_of_each, pose

FORMATS = pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])


def write_some(bag, count=20):
    """Some of the topics, over and again."""
    for index in range(count):
        now_ns = index * 10_000_000
        bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, bytes, encode_clock(now_ns))
        bag.publish(topics.TF, topics.ODOM_NODE, now_ns, bytes, ODOM_POSE)
        bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, bytes, pose(now_ns))
        bag.publish(topics.SCAN, topics.SIMULATOR_NODE, now_ns, bytes, encode_scan(SCAN, 'laser', 0.1))
        bag.publish(topics.TF, topics.AMCL_NODE, now_ns, bytes, MAP_POSE)


def written(path):
    """Each message as (topic, time, message), and the connections in their order."""
    with AnyReader([path]) as reader:
        return (
            [
                (connection.topic, time_ns, reader.deserialize(raw, connection.msgtype))
                for connection, time_ns, raw in reader.messages()
            ],
            sorted(reader.connections, key=lambda connection: connection.id),
        )


@contextlib.contextmanager
def largest_file(size):
    """The kernel refuses to let a file grow further, as it does on a full disk."""
    _, hard = before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_each_publisher_has_its_connection_in_order_of_use(tmp_path):
    path = tmp_path / 'a.bag'
    with TrialBag(path, 'full') as bag:
        write_some(bag)
        bag.publish(topics.TRIAL_RESULT, topics.NAVIGATION_TRIAL_NODE, 10**9, bytes, encode_string('{}'))
    _, connections = written(path)
    assert [
        (connection.topic, connection.ext.callerid, connection.ext.latching, connection.msgcount)
        for connection in connections
    ] == [
        ('/clock', '/simulator_node', 0, 20),
        ('/tf', '/gz_diff_odom_node', 0, 20),
        ('/world_pose', '/world_pose_node', 0, 20),
        ('/scan', '/simulator_node', 0, 20),
        ('/tf', '/amcl', 0, 20),
        ('/trial_result', '/navigation_trial_node', 1, 1),
    ]


def test_each_publisher_counts_its_headers_from_one(tmp_path):
    path = tmp_path / 'a.bag'
    with TrialBag(path, 'full') as bag:
        for _ in range(3):
            bag.publish(topics.ODOM, topics.ODOM_NODE, 5, bytes, pose())  # any type that begins with a header
            bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, 5, bytes, pose())
            bag.publish(topics.TF, topics.ODOM_NODE, 5, bytes, ODOM_POSE)
    with AnyReader([path]) as reader:
        raw = {
            topic: [bytes(raw) for connection, _, raw in reader.messages() if connection.topic == topic]
            for topic in (topics.ODOM, topics.WORLD_POSE, topics.TF)
        }
    for topic in (topics.ODOM, topics.WORLD_POSE):
        assert raw[topic] == [bytes([seq, 0, 0, 0]) + pose()[4:] for seq in (1, 2, 3)]
    assert raw[topics.TF] == [ODOM_POSE] * 3


def test_a_minimal_recording_is_what_analysis_reads(tmp_path):
    path = tmp_path / 'a.bag'
    trial = Trial(test=load_test('SL', ROOT / 'config'), ppr=90, number=1)
    with TrialBag(path, 'minimal') as bag:
        bag.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, 0, bytes, encode_string(trial.model_dump_json()))
        write_some(bag)
        bag.publish(topics.TRIAL_RESULT, topics.NAVIGATION_TRIAL_NODE, 10**9, encode_string, '{"outcome": "succeeded"}')
    recording = read_trial(path)
    assert (recording.trial, recording.outcome) == (trial, Outcome.SUCCEEDED)
    assert recording.poses[topics.WORLD_POSE].stamps_ns.tolist() == [10_000_000 * index for index in range(20)]
    assert {connection.topic for connection in written(path)[1]} == {'/trial', '/world_pose', '/trial_result'}


@pytest.mark.parametrize('error', [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize('count', [0, 1000])
@FORMATS
def test_an_exception_leaves_no_file(tmp_path, error, count, bag_format):
    with pytest.raises(error):
        with TrialBag(tmp_path / 'a.bag', 'full', bag_format) as bag:
            write_some(bag, count)
            raise error
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_replaced(tmp_path):
    path = tmp_path / 'a.bag'
    (tmp_path / 'a.bag.active').write_bytes(b'torn')
    path.write_bytes(b'old')
    with TrialBag(path, 'full') as bag:
        write_some(bag)
        assert path.read_bytes() == b'old'
    assert os.listdir(str(tmp_path)) == ['a.bag']
    assert len(written(path)[0]) == 100


# Some fail at a chunk of 1 MiB, some at the last chunk or the index, when the bag is closed.
@pytest.mark.parametrize('size', [5_000, 2_000_000])
@FORMATS
def test_a_file_that_cannot_grow_is_named_and_removed(tmp_path, size, bag_format):
    path = tmp_path / 'a.bag'
    with pytest.raises(OSError) as caught, largest_file(size):
        with TrialBag(path, 'full', bag_format) as bag:
            write_some(bag, count=1000)
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(path))
    assert 'bag cannot be written: File too large' in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_ros_reads_it(tmp_path):
    rosbag = pytest.importorskip('rosbag')
    path = tmp_path / 'a.bag'
    expected = {}
    with TrialBag(path, 'full') as bag:
        for time_ns in range(0, 10**10, 10**7):  # several chunks
            for topic, node, message in one_of_each():
                bag.publish(topic.name, node, time_ns, bytes, message)
                md5sum = definition(topic.message_type).md5sum
                expected.setdefault(
                    (topic.name, node), (topic.message_type.replace('/msg/', '/'), md5sum, str(int(topic.is_latched)))
                )
    with rosbag.Bag(str(path)) as read:
        headers = [
            {key: value.decode() for key, value in connection.header.items()} for connection in read._get_connections()
        ]
        assert {
            (about['topic'], about['callerid']): (about['type'], about['md5sum'], about['latching'])
            for about in headers
        } == expected
        times_ns = [time.to_nsec() for _, _, time in read.read_messages()]
        assert times_ns == sorted(times_ns)
        assert len(times_ns) == 1000 * len(expected) == read.get_message_count()
        assert f'messages:    {len(times_ns)}' in str(read)  # what rosbag info prints


@pytest.mark.parametrize('own_each', [7])
@pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])
def test_own_messages_stand_between_common_ones_however_many_wait(tmp_path, own_each, bag_format):
    """Of either kind more are published than wait to be written at once."""

    def drive(own_bags, common):
        for tick in range(1, 2500):
            time_ns = 10**7 * tick
            common.publish(topics.CLOCK, topics.SIMULATOR_NODE, time_ns, encode_clock, time_ns)
            if tick > 30:  # its description comes late
                common.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, time_ns, encode_pose_stamped, *pose(tick))
            for bag in own_bags:
                for _ in range(own_each):
                    bag.publish(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, time_ns, encode_pose_stamped, *pose(tick))

    def pose(tick):
        return Pose2D(0.01 * tick, 0.0, 0.0), 10**7 * tick, 'map'

    with TrialBag(tmp_path / 'a', 'full', bag_format) as first, TrialBag(tmp_path / 'b', 'full', bag_format) as second:
        drive([first, second], TrialBags([first, second]))
    with TrialBag(tmp_path / 'alone', 'full', bag_format) as alone:
        drive([alone], alone)
    contents = {(tmp_path / name).read_bytes() for name in ('a', 'b', 'alone')}
    assert len(contents) == 1
