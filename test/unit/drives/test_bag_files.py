"""MCAP files: what the bag of ROS 1 has, as others read them, also torn and damaged; bags of ROS 1."""

import random

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_files import SUFFIXES, Ros1File
from diff_encoder_sim.drives.bag_source import MCAP_MAGIC, McapStream
from diff_encoder_sim.drives.message_encoders import with_seq
from diff_encoder_sim.drives.topics import TOPICS, RecordedTopic
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.typestore import definition
from recorded_messages import one_of_each

TIMES_NS = range(0, 10**9, 10**8)


def write(path, bag_format, times_ns):
    """Every topic of every node, at each of the times."""
    messages = one_of_each()
    with TrialBag(path, 'full', bag_format) as bag:
        for time_ns in times_ns:
            for topic, node, message in messages:
                bag.publish(topic.name, node, time_ns, bytes, message)
    return path


@pytest.fixture(scope='module')
def paths(tmp_path_factory):
    """(ROS 1, MCAP)."""
    folder = tmp_path_factory.mktemp('bags')
    return [write(folder / f'a{suffix}', bag_format, TIMES_NS) for bag_format, suffix in SUFFIXES.items()]


def without_seq(message):
    """A message of either ROS as nested dicts; ROS 2 has no message without fields."""
    if isinstance(message, list):
        return [without_seq(each) for each in message]
    if not hasattr(message, '__dataclass_fields__'):
        return message.tolist() if hasattr(message, 'tolist') else message
    others = '__msgtype__', 'structure_needs_at_least_one_member', 'seq'
    names = [name for name in message.__dataclass_fields__ if name.islower() and name not in others]
    return {name: without_seq(getattr(message, name)) for name in names}


def by_mcap(path):
    """(topic, type, definition, time, message) as the library of the format's authors reads them."""
    with open(path, 'rb') as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == 'ros2'
        assert reader.get_summary().statistics.message_count == len(TIMES_NS) * len(one_of_each())
        return [
            (channel.topic, schema.name, schema.data.decode(), message.log_time, message.data)
            for schema, channel, message in reader.iter_messages()
        ]


def decoded(rows):
    """(time, message) by topic, decoded by the definitions in the file itself; nodes may share a topic at one time."""
    found, store = {}, get_typestore(Stores.EMPTY)
    for topic, kind, text, time_ns, raw in rows:
        if kind not in store.types:
            types = get_types_from_msg(text, kind)
            store.register({name: fields for name, fields in types.items() if name not in store.types})
        found.setdefault(topic, []).append((time_ns, without_seq(store.deserialize_cdr(raw, kind))))
    return {topic: sorted(rows, key=repr) for topic, rows in found.items()}


@pytest.fixture(scope='module')
def expected(paths):
    found = {}
    with AnyReader([paths[0]]) as reader:
        for each, time_ns, raw in reader.messages():
            found.setdefault(each.topic, []).append((time_ns, without_seq(reader.deserialize(raw, each.msgtype))))
    return {topic: sorted(rows, key=repr) for topic, rows in found.items()}


def test_the_mcap_library_reads_what_the_bag_of_ros_1_has(paths, expected):
    assert decoded(by_mcap(paths[1])) == expected


def test_rosbags_reads_it(paths, expected):
    if not hasattr(Reader, 'STORAGE_PLUGINS') or '.mcap' not in Reader.STORAGE_PLUGINS:
        pytest.skip('this rosbags reads only folders')
    with Reader(paths[1]) as reader:
        topics_of = {
            each.topic: (each.msgtype, each.ext.offered_qos_profiles[0].durability.name == 'TRANSIENT_LOCAL')
            for each in reader.connections
        }
        rows = [(each.topic, each.msgtype, each.msgdef.data, time_ns, raw) for each, time_ns, raw in reader.messages()]
    assert topics_of == {topic.name: (topic.message_type, topic.is_latched) for topic in TOPICS if topic.nodes}
    assert decoded(rows) == expected


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """A file of two chunks and more."""
    return write(tmp_path_factory.mktemp('whole') / 'a.mcap', 'mcap', range(1, 200))


def read(path):
    stream = McapStream(path)
    return list(stream.messages(topics.RECORDED)), stream.fault


def test_wherever_it_is_torn_or_changed_its_beginning_is_read(whole, tmp_path):
    content, (messages, _) = whole.read_bytes(), read(whole)
    path, counts = tmp_path / 'a.mcap', []
    for size in range(len(MCAP_MAGIC), len(content), len(content) // 20):
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
        theirs.write(connections[number], time_ns, with_seq(message, seqs[number]) if has_header else message)
    ours.close()
    theirs.close()
    content = (tmp_path / 'ours.bag').read_bytes()
    assert content == (tmp_path / 'theirs.bag').read_bytes() and len(content) > 1_000_000
