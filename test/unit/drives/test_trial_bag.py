"""A trial's bag: connections of nodes, complete or absent, the same bytes each time; as others read it, or torn."""

import errno
import os
import random
import resource
from dataclasses import asdict

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_files import SUFFIXES, Ros1File
from diff_encoder_sim.drives.bag_source import MCAP_MAGIC, McapStream
from diff_encoder_sim.drives.topics import TOPICS, RecordedTopic
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.drives.trial_recording import read_trial
from diff_encoder_sim.drives.typestore import definition
from message_values import encoded_and_expected
from trial_bags import trial

SCAN = Scan(0, -3.0, 0.01, 0.15, 6.0, np.linspace(0.2, 5.0, 600))
ODOM_POSE = encoders.encode_tf(encoders.encode_transform(Pose2D(1.0, 2.0, 0.5), 7, 'odom', 'base_link'))
MAP_POSE = encoders.encode_tf(encoders.encode_transform(Pose2D(3.0, 2.0, 0.1), 7, 'map', 'odom'))


def pose(stamp_ns=0):
    return encoders.encode_pose_stamped(Pose2D(1.0, 2.0, 0.5), stamp_ns, 'map')


def one_of_each():
    """(topic, node, message) of all that nodes publish."""
    cases = encoded_and_expected(np.random.default_rng(1))
    encoded = {kind.replace('/', '/msg/'): message for message, kind, *_ in cases}
    return [(topic, node, encoded[topic.message_type]) for topic in topics.TOPICS for node in topic.nodes]


FORMATS = pytest.mark.parametrize('bag_format', ['ros1', 'mcap'])


def write_some(bag, count=20):
    """Some of the topics, again and again."""
    for index in range(count):
        now_ns = index * 10_000_000
        bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, encoders.encode_clock, now_ns)
        bag.publish(topics.TF, topics.ODOM_NODE, now_ns, bytes, ODOM_POSE)
        bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, pose, now_ns)
        bag.publish(topics.SCAN, topics.SIMULATOR_NODE, now_ns, encoders.encode_scan, SCAN, 'laser', 0.1)
        bag.publish(topics.TF, topics.AMCL_NODE, now_ns, bytes, MAP_POSE)
    bag.publish(
        topics.TRIAL_RESULT, topics.NAVIGATION_TRIAL_NODE, 10**11, encoders.encode_string, '{"outcome": "succeeded"}'
    )


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
        bag.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, 0, encoders.encode_string, trial().model_dump_json())
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


TIMES_NS = range(0, 10**9, 10**8)


def write(path, bag_format, times_ns):
    """Every topic of every node, at each of the times."""
    messages = one_of_each()
    with TrialBag(path, 'full', bag_format) as bag:
        for time_ns in times_ns:
            for topic, node, message in messages:
                bag.publish(topic.name, node, time_ns, bytes, message)
    return path


def without_seq(message):
    """A message of either ROS as nested dicts; ROS 2 has no message without fields."""
    others = 'structure_needs_at_least_one_member', 'seq'

    def fields_of(items):
        return {
            name: value.tolist() if hasattr(value, 'tolist') else value for name, value in items if name not in others
        }

    return asdict(message, dict_factory=fields_of)


def by_topic(rows):
    """(time, message) by topic, sorted, as nodes may share a topic at one time."""
    found = {}
    for topic, time_ns, message in rows:
        found.setdefault(topic, []).append((time_ns, without_seq(message)))
    return {topic: sorted(of_topic, key=repr) for topic, of_topic in found.items()}


def decoded(rows):
    """Decode messages by the definitions in the file itself."""
    store = get_typestore(Stores.EMPTY)
    for topic, kind, text, time_ns, raw in rows:
        if kind not in store.types:
            types = get_types_from_msg(text, kind)
            store.register({name: fields for name, fields in types.items() if name not in store.types})
        yield topic, time_ns, store.deserialize_cdr(raw, kind)


def test_others_read_from_an_mcap_file_what_the_bag_of_ros_1_has(tmp_path):
    """The library of the format's authors, and rosbags, if its version reads files."""
    of_ros1, mcap = (write(tmp_path / f'a{SUFFIXES[kind]}', kind, TIMES_NS) for kind in ('ros1', 'mcap'))
    with AnyReader([of_ros1]) as reader:
        messages = ((each.topic, ns, reader.deserialize(raw, each.msgtype)) for each, ns, raw in reader.messages())
        expected = by_topic(messages)
    with open(mcap, 'rb') as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == 'ros2'
        assert reader.get_summary().statistics.message_count == sum(map(len, expected.values()))
        rows = [
            (channel.topic, schema.name, schema.data.decode(), message.log_time, message.data)
            for schema, channel, message in reader.iter_messages()
        ]
    assert by_topic(decoded(rows)) == expected
    if '.mcap' in getattr(Reader, 'STORAGE_PLUGINS', ()):
        with Reader(mcap) as reader:
            topics_of = {
                each.topic: (each.msgtype, each.ext.offered_qos_profiles[0].durability.name == 'TRANSIENT_LOCAL')
                for each in reader.connections
            }
            rows = [(each.topic, each.msgtype, each.msgdef.data, ns, raw) for each, ns, raw in reader.messages()]
        assert topics_of == {topic.name: (topic.message_type, topic.is_latched) for topic in TOPICS if topic.nodes}
        assert by_topic(decoded(rows)) == expected


def read(path):
    stream = McapStream(path)
    return list(stream.messages(topics.RECORDED)), stream.fault


def test_wherever_it_is_torn_or_changed_its_beginning_is_read(tmp_path):
    path, counts = write(tmp_path / 'a.mcap', 'mcap', range(1, 200)), []  # two chunks and more
    content, (messages, _) = path.read_bytes(), read(path)
    for size in (*range(len(MCAP_MAGIC), len(content), len(content) // 20), len(content) - 20):
        path.write_bytes(content[:size])
        found, fault = read(path)
        assert fault and found == messages[: len(found)]
        counts.append(len(found))
    assert counts == sorted(counts) and counts[-1] == len(messages) > counts[len(counts) // 2] > 0
    changed = content.rindex(b'base_link')
    path.write_bytes(content[:changed] + b'B' + content[changed + 1 :])
    found, fault = read(path)
    assert found == messages[: len(found)] and 0 < len(found) < len(messages) and 'damaged' in fault


TYPES = ['std_msgs/msg/String', 'nav_msgs/msg/Odometry', 'rosgraph_msgs/msg/Clock']


def test_a_bag_of_ros_1_is_that_of_rosbags_byte_for_byte_over_several_chunks(tmp_path):
    rng = random.Random(1)
    messages = [
        (rng.randrange(3), 1 + 7_000_000 * (number // 2), bytes(rng.choices(range(256), k=rng.choice((4, 8, 700)))))
        for number in range(4000)
    ]
    ours, theirs = Ros1File(tmp_path / 'ours.bag'), Writer(tmp_path / 'theirs.bag')
    theirs.open()
    connections = []
    for number, kind in enumerate(TYPES):
        ours.add_publisher(RecordedTopic(f'/topic{number}', kind, ()), '/node')
        known = definition(kind)
        about = dict(msgdef=known.text, md5sum=known.md5sum, callerid='/node', latching=0)
        connections.append(theirs.add_connection(f'/topic{number}', kind, **about))
    seqs = [0] * len(TYPES)
    for number, time_ns, message in messages:
        seqs[number] += 1
        ours.write_prepared([ours.prepare(number, time_ns, message)])
        has_header = TYPES[number] == 'nav_msgs/msg/Odometry'
        theirs.write(connections[number], time_ns, encoders.with_seq(message, seqs[number]) if has_header else message)
    ours.close()
    theirs.close()
    content = (tmp_path / 'ours.bag').read_bytes()
    assert content == (tmp_path / 'theirs.bag').read_bytes() and len(content) > 1_000_000
