"""A trial's bag: what the nodes' connections would be, complete or absent, the same bytes each time."""

import errno
import os
import resource

import pytest
from rosbags.highlevel import AnyReader

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import encode_clock, encode_pose_stamped, encode_scan, encode_string
from diff_encoder_sim.drives.trial_bag import TrialBag, TrialBags
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.drives.trial_recording import read_trial
from recorded_messages import MAP_POSE, ODOM_POSE, SCAN, pose
from trial_bags import trial

FORMATS = pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])


def write_some(bag, count=20):
    """Some of the topics, again and again."""
    for index in range(count):
        now_ns = index * 10_000_000
        bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, encode_clock, now_ns)
        bag.publish(topics.TF, topics.ODOM_NODE, now_ns, bytes, ODOM_POSE)
        bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, pose, now_ns)
        bag.publish(topics.SCAN, topics.SIMULATOR_NODE, now_ns, encode_scan, SCAN, 'laser', 0.1)
        bag.publish(topics.TF, topics.AMCL_NODE, now_ns, bytes, MAP_POSE)
    bag.publish(topics.TRIAL_RESULT, topics.NAVIGATION_TRIAL_NODE, 10**11, encode_string, '{"outcome": "succeeded"}')


def connections_of(path):
    with AnyReader([path]) as reader:
        connections = sorted(reader.connections, key=lambda each: each.id)
        return [(each.topic, each.ext.callerid, each.ext.latching, each.msgcount) for each in connections]


def test_each_publisher_has_its_connection_in_order_of_use_and_counts_its_headers_from_one(tmp_path):
    path = tmp_path / 'a.bag'
    with TrialBag(path, 'full') as bag:
        write_some(bag, 3)
        bag.publish(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, 10**11, pose)
    assert connections_of(path) == [
        ('/clock', '/simulator_node', 0, 3),
        ('/tf', '/gz_diff_odom_node', 0, 3),
        ('/world_pose', '/world_pose_node', 0, 3),
        ('/scan', '/simulator_node', 0, 3),
        ('/tf', '/amcl', 0, 3),
        ('/trial_result', '/navigation_trial_node', 1, 1),
        ('/global_pose', '/global_pose_node', 0, 1),
    ]
    raw = {}
    with AnyReader([path]) as reader:
        for connection, _, content in reader.messages():
            raw.setdefault(connection.topic, []).append(bytes(content))
    assert raw['/world_pose'] == [
        bytes([seq, 0, 0, 0]) + pose(10**7 * index)[4:] for index, seq in enumerate((1, 2, 3))
    ]
    assert raw['/global_pose'] == [b'\1\0\0\0' + pose()[4:]] and raw['/tf'] == [ODOM_POSE, MAP_POSE] * 3


def test_a_minimal_recording_contains_what_analysis_reads(tmp_path):
    path = tmp_path / 'a.bag'
    with TrialBag(path, 'minimal') as bag:
        bag.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, 0, encode_string, trial().model_dump_json())
        write_some(bag)
    recording = read_trial(path)
    assert (recording.trial, recording.outcome) == (trial(), Outcome.SUCCEEDED)
    assert recording.poses[topics.WORLD_POSE].stamps_ns.tolist() == [10_000_000 * index for index in range(20)]
    assert {topic for topic, *_ in connections_of(path)} == {'/trial', '/world_pose', '/trial_result'}


@pytest.mark.parametrize(('error', 'count'), [(RuntimeError, 0), (KeyboardInterrupt, 1000)])
@FORMATS
def test_an_exception_leaves_no_file(tmp_path, error, count, bag_format):
    with pytest.raises(error), TrialBag(tmp_path / 'a.bag', 'full', bag_format) as bag:
        write_some(bag, count)
        raise error
    assert list(tmp_path.iterdir()) == []


def test_the_file_of_a_killed_process_is_replaced(tmp_path):
    path = tmp_path / 'a.bag'
    (tmp_path / 'a.bag.active').write_bytes(b'torn')
    path.write_bytes(b'old')
    with TrialBag(path, 'full') as bag:
        write_some(bag)
        assert path.read_bytes() == b'old'
    assert os.listdir(str(tmp_path)) == ['a.bag'] and len(connections_of(path)) == 6


# Some fail at a chunk of 1 MiB, some at the last chunk or the index, when the bag is closed.
@pytest.mark.parametrize('size', [10, 5_000, 2_000_000])
@FORMATS
def test_a_file_that_cannot_grow_is_named_and_removed(tmp_path, size, bag_format):
    """The kernel refuses to let a file grow further, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        with pytest.raises(OSError) as caught, TrialBag(tmp_path / 'a.bag', 'full', bag_format) as bag:
            write_some(bag, count=1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (caught.value.errno, caught.value.filename) == (errno.EFBIG, str(tmp_path / 'a.bag'))
    assert list(tmp_path.iterdir()) == []


@FORMATS
def test_bags_with_common_messages_are_those_of_single_ones(tmp_path, bag_format):
    """More messages of either kind are published than are written at once."""
    paths = [tmp_path / name for name in ('a', 'b', 'single')]
    first, second, single = (TrialBag(path, 'full', bag_format) for path in paths)
    with first, second, single:
        for own_bags, common in (([first, second], TrialBags([first, second])), ([single], single)):
            for time_ns in range(10**7, 25 * 10**9, 10**7):
                stamped = Pose2D(1e-9 * time_ns, 0.0, 0.0), time_ns, 'map'
                common.publish(topics.CLOCK, topics.SIMULATOR_NODE, time_ns, encode_clock, time_ns)
                if time_ns > 3 * 10**8:  # its description is late
                    common.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, time_ns, encode_pose_stamped, *stamped)
                for bag in own_bags:
                    bag.publish(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, time_ns, encode_pose_stamped, *stamped)
    assert len({path.read_bytes() for path in paths}) == 1
