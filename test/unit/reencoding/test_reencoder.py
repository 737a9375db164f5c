"""The reencode command: what it writes and prints of good drives, and what it says of bad ones."""

import csv
import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli import reencode
from diff_encoder_sim.encoders.counter import wrap_count
from diff_encoder_sim.encoders.wheel_encoder import DiffEncoder, EncoderParams
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams, WheelOdometry
from diff_encoder_sim.recording.bag_opening import open_bag
from diff_encoder_sim.reencoding.bag_output import ReencodedBag
from diff_encoder_sim.serialization.joint_messages import encode_encoder_pulse
from diff_encoder_sim.serialization.pose_messages import POSE_TYPES, encode_odometry
from diff_encoder_sim.serialization.transform_messages import encode_tf, encode_transform
from diff_encoder_sim.serialization.typestore import STORE
from reencoding_drives import (
    JOINTS,
    ROS1,
    ROS2,
    START_NS,
    TICK_NS,
    angles_rad,
    drive,
    true_poses,
    without_index,
    write_ros1,
    write_ros2,
)

PPRS = (40, 90, 1024)


def run(*arguments):
    reencode.main([str(argument) for argument in arguments])


def complaint(capsys, *arguments):
    """The one line of a run that fails."""
    with pytest.raises(SystemExit) as error:
        run(*arguments)
    text = str(error.value)
    assert text.startswith('reencode: ') and '\n' not in text
    return text


def contents(path):
    """Raw messages by topic, without the seq of their headers."""
    found = {}
    with open_bag(path) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(bytes(raw)[4:])
    return found


def rows_of(folder):
    with open(folder / 'reencode.csv', newline='') as file:
        return list(csv.DictReader(file))


def samples_of(angles, ppr):
    """What a live encoder says of a drive at 100 Hz."""
    encoder = DiffEncoder(EncoderParams(ppr=ppr))
    samples = [encoder.update(START_NS + tick * TICK_NS, JOINTS, pair) for tick, pair in enumerate(angles.tolist())]
    return [sample for sample in samples if sample is not None]


@pytest.fixture
def bag(tmp_path):
    return write_ros1(tmp_path / 'drive.bag', drive())


def test_bags_hold_what_the_nodes_would_have_published(tmp_path, bag):
    run(bag, '--ppr', *PPRS, '--out', tmp_path / 'out')
    for ppr in PPRS:
        odometry = WheelOdometry(OdometryParams(ppr=ppr))
        samples = samples_of(angles_rad(501), ppr)
        estimates = [odometry.update(*sample) for sample in samples]
        found = contents(tmp_path / 'out' / ('drive_%dppr.bag' % ppr))
        assert found == {
            '/world_pose': contents(bag)['/world_pose'],
            '/encoder_pulse': [encode_encoder_pulse(sample, JOINTS)[4:] for sample in samples],
            '/odom': [encode_odometry(estimate, 'odom', 'base_link')[4:] for estimate in estimates],
            '/tf': [
                encode_tf(encode_transform(estimate.base_pose_in_odom, estimate.stamp_ns, 'odom', 'base_link'))[4:]
                for estimate in estimates
            ],
        }
        assert len(samples) == 101


def test_errors_are_those_of_the_odometry(tmp_path, bag, capsys):
    run(bag, '--ppr', *PPRS, '--out', tmp_path / 'out')
    truth = true_poses(angles_rad(501))[::5]
    for ppr, row in zip(PPRS, rows_of(tmp_path / 'out')):
        odometry = WheelOdometry(OdometryParams(ppr=ppr))
        poses = [odometry.update(*sample).base_pose_in_odom for sample in samples_of(angles_rad(501), ppr)]
        offsets = np.array([(pose.x_m - true.x_m, pose.y_m - true.y_m) for pose, true in zip(poses, truth)])
        assert (row['ppr'], row['common_stamps'], row['reports']) == (str(ppr), '101', '101')
        assert float(row['ate_rmse_m']) == pytest.approx(math.sqrt((offsets**2).sum(axis=1).mean()), abs=1e-12)
        assert [float(row['end_x_m']), float(row['end_y_m'])] == pytest.approx(offsets[-1].tolist(), abs=1e-12)
        assert '{:.4f}'.format(float(row['ate_rmse_m'])) in capsys.readouterr().out or ppr != PPRS[0]


def test_without_a_reference_the_finest_is_one(tmp_path, capsys):
    run(write_ros1(tmp_path / 'a.bag', drive(reference=None)), '--ppr', '4096', '40', '--out', tmp_path / 'out')
    finest, coarse = rows_of(tmp_path / 'out')
    assert finest['ate_rmse_m'] == '' and 0.0 < float(coarse['ate_rmse_m']) < 0.05
    assert 'compared with the odometry of the finest PPR' in capsys.readouterr().out


@pytest.mark.parametrize('kind', POSE_TYPES)
@pytest.mark.parametrize('plugin', [None, 'sqlite3', 'mcap'])
def test_references_of_every_type_in_every_bag(tmp_path, kind, plugin):
    rows = drive(ROS2 if plugin else ROS1, reference='/truth', kind=kind)
    path = write_ros2(tmp_path / 'a', rows, plugin) if plugin else write_ros1(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '100000', '--reference', '/truth', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert row['common_stamps'] == '101' and float(row['ate_max_m']) < 1e-4


@pytest.mark.parametrize('maker', [ROS1, ROS2], ids=['ROS 1', 'ROS 2'])
def test_two_frames_as_reference(tmp_path, maker):
    """map -> odom -> base -> base_link, the first moving now and then, the last fixed."""
    odom_in_map, link_in_base = Pose2D(1.0, 2.0, 0.3), Pose2D(0.0, 0.0, 0.2)
    rows = [('/tf_static', START_NS, maker.tf(maker.transform(0, link_in_base, 'base', 'base_link')))]
    for index, (topic, now_ns, message) in enumerate(drive(maker, reference=None)):
        rows.append((topic, now_ns, message))
        if index % 100 == 0:
            rows.append(('/tf', now_ns, maker.tf(maker.transform(now_ns + 10**9, odom_in_map, 'map', 'odom'))))
    for tick, pose in enumerate(true_poses(angles_rad(501))):
        if tick % 5 == 0:
            now_ns = START_NS + tick * TICK_NS
            base_in_odom = pose.compose(link_in_base.inverse())
            rows.append(('/tf', now_ns, maker.tf(maker.transform(now_ns, base_in_odom, 'odom', 'base'))))
    rows.sort(key=lambda row: row[1])
    write, name = (write_ros2, 'a') if maker is ROS2 else (write_ros1, 'a.bag')
    run(write(tmp_path / name, rows), '--ppr', '100000', '--reference', 'map->base_link', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert row['common_stamps'] == '101' and float(row['ate_max_m']) < 1e-4


@pytest.mark.parametrize('modulus', [0, 256])
@pytest.mark.parametrize('maker', [ROS1, ROS2], ids=['ROS 1', 'ROS 2'])
def test_counts_of_a_finer_encoder_give_the_counts_of_its_divisors(tmp_path, maker, modulus):
    angles = angles_rad(2001, speeds_radps=(-4.0, 4.4))
    rows = [
        ('/fine', stamp_ns, maker.pulses(stamp_ns, [wrap_count(count, modulus) for count in counts]))
        for stamp_ns, *counts in samples_of(angles, 1024)
    ]
    config = tmp_path / 'config.yaml'
    config.write_text('counter_modulus: %d\n' % modulus)
    write, name = (write_ros2, 'a') if maker is ROS2 else (write_ros1, 'a.bag')
    run(
        write(tmp_path / name, rows),
        '--pulses-ppr',
        '1024',
        '--ppr',
        '64',
        '100',
        '--out',
        tmp_path / 'out',
        '--config',
        config,
    )
    found = {
        ppr: [
            STORE.deserialize_ros1(b'\0\0\0\0' + raw, 'diff_encoder_sim/msg/EncoderPulse').pulses.tolist()
            for raw in contents(tmp_path / 'out' / ('a_%dppr.bag' % ppr))['/encoder_pulse']
        ]
        for ppr in (64, 100)
    }
    expected = {
        ppr: [[wrap_count(count, modulus) for count in sample[1:]] for sample in samples_of(angles, ppr)]
        for ppr in (64, 100)
    }
    if modulus == 0:
        assert found[64] == expected[64]
        differences = np.subtract(found[100], expected[100])
        assert set(np.abs(differences).ravel()) <= {0, 1}
        assert np.count_nonzero(differences) <= 1.5 * 0.25 * 100 / 1024 * differences.size
    # A wrapped count tells travel alone: the steps are those of the drive, up to its unknown start.
    steps = np.diff(np.array(found[64]), axis=0)
    assert [[wrap_count(int(step), modulus) for step in pair] for pair in steps] == np.diff(
        [sample[1:] for sample in samples_of(angles, 64)], axis=0
    ).tolist()


def test_names_of_joints_are_found_or_given(tmp_path):
    names = ('arm', 'front_RIGHT_wheel', 'wheel_l')
    rows = [
        ('/js', START_NS + tick * TICK_NS, ROS1.joint_state(START_NS + tick * TICK_NS, (9.0, right, left), names))
        for tick, (left, right) in enumerate(angles_rad(101))
    ]
    path = write_ros1(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '90', '--out', tmp_path / 'found')
    run(path, '--ppr', '90', '--out', tmp_path / 'given', '--left', 'wheel_l', '--right', 'front_RIGHT_wheel')
    found = contents(tmp_path / 'found' / 'a_90ppr.bag')
    assert found == contents(tmp_path / 'given' / 'a_90ppr.bag')
    assert found['/encoder_pulse'] == [
        encode_encoder_pulse(sample, ('wheel_l', 'front_RIGHT_wheel'))[4:] for sample in samples_of(angles_rad(101), 90)
    ]


def test_a_crashed_bag_is_read_as_far_as_it_goes(tmp_path, bag, capsys):
    torn = tmp_path / 'torn.bag.active'
    torn.write_bytes(without_index(bag.read_bytes())[:-20_000])
    run(torn, '--ppr', '90', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert 50 < int(row['reports']) < 101
    assert 'torn.bag.active: ' in capsys.readouterr().err


def test_bad_messages_are_counted_and_the_rest_is_used(tmp_path, capsys):
    rows = drive()
    joints = [index for index, row in enumerate(rows) if row[0] == '/joint_states']
    for index in joints[10:20]:
        rows[index][2].position[0] = np.nan
    rows[joints[30]][2].name[0] = JOINTS[1]
    rows[joints[30]][2].position = np.zeros(2)
    run(write_ros1(tmp_path / 'a.bag', rows), '--ppr', '90', '40')
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "reencode: %s: /joint_states: 11 messages dropped; of the first: joint 'left_wheel_joint' has "
        'position nan; expected a finite angle [rad]' % (tmp_path / 'a.bag')
    ]


def test_time_that_goes_back_is_told_once(tmp_path, capsys, caplog):
    rows = drive(count=301)
    path = write_ros1(tmp_path / 'a.bag', rows + rows)
    run(path, '--ppr', '90', '40', '--out', tmp_path / 'out')
    assert any('joint stamps went back' in record.getMessage() for record in caplog.records)
    assert all(int(row['reports']) == 122 for row in rows_of(tmp_path / 'out'))
    assert all(float(row['ate_max_m']) < 0.05 for row in rows_of(tmp_path / 'out'))


def two_robots(path):
    return write_ros1(path, drive() + drive(joint_topic='/robot2/joint_states', reference=None))


def counts_only(path):
    return write_ros1(path, [('/fine', START_NS, ROS1.pulses(START_NS, [1, 2]))])


def one_message(path):
    return write_ros1(path, drive()[:1])


def whole(path):
    return write_ros1(path, drive())


def no_time(path):
    return write_ros1(
        path, [('/joint_states', START_NS + tick, ROS1.joint_state(0, (0.1, 0.2))) for tick in range(300)]
    )


@pytest.mark.parametrize(
    ('make', 'arguments', 'texts'),
    [
        (None, [], ['no such bag']),
        (two_robots, [], ['/joint_states, /robot2/joint_states', '--joint-states']),
        (counts_only, [], ['/fine', '--pulses-ppr']),
        (counts_only, ['--pulses-ppr', '64'], ['--ppr: given 90', 'at most 64', '/fine']),
        (no_time, [], ['/joint_states', 'stamps stand still']),
        (one_message, [], ['/joint_states', 'no drive', 'too short']),
        (lambda path: write_ros1(path, drive(names=('a', 'b'))), [], ['/joint_states', '--left', 'a, b']),
        (
            lambda path: write_ros1(path, drive(names=('wheel_1', 'wheel_2'))),
            [],
            ['left_wheel_joint', 'wheel_1, wheel_2'],
        ),
        (lambda path: write_ros1(path, drive()[1:2]), [], ['no topic of sensor_msgs/msg/JointState', '/world_pose']),
        (whole, ['--joint-states', '/world_pose'], ['PoseStamped', '/joint_states']),
        (whole, ['--pulses-ppr', '1024'], ['--pulses-ppr', '/joint_states has wheel angles', '--pulses TOPIC']),
        (whole, ['--joint-states', '/a', '--pulses', '/b'], ['given both']),
        (whole, ['--left', 'arm'], ["'arm'", ', '.join(JOINTS)]),
        (whole, ['--left', JOINTS[1]], ['both wheels']),
        (whole, ['--reference', '/odom'], ['/odom', 'not there', '/world_pose']),
        (whole, ['--reference', '/joint_states'], ['JointState', '/world_pose']),
        (whole, ['--reference', 'map->base_link'], ['map->base_link', '/tf']),
        (whole, ['--reference', 'map->'], ["'map->'", 'two frames']),
        (whole, ['--ppr', '0'], ['--ppr', '0', 'greater than 0']),
        (whole, ['--ppr', 'many'], ['--ppr', 'many']),
        (whole, ['--ppr', '90', '90.0'], ['90 twice']),
        (whole, ['--config', 'no.yaml'], ['no.yaml', 'cannot be read']),
        (whole, ['--out', '/proc/out'], ['/proc/out']),
    ],
)
def test_mistakes_are_named_in_one_line(tmp_path, capsys, make, arguments, texts):
    if make is not None:
        make(tmp_path / 'a.bag')
    ppr = [] if '--ppr' in arguments else ['--ppr', '90']
    text = complaint(capsys, tmp_path / 'a.bag', *ppr, *arguments)
    for part in texts:
        assert part in text


def test_nothing_is_overwritten_and_nothing_half_done_is_left(tmp_path, bag, capsys):
    run(bag, '--ppr', '90', '--out', tmp_path / 'out')
    before = {path: path.read_bytes() for path in (tmp_path / 'out').iterdir()}
    assert 'drive_90ppr.bag exists' in complaint(capsys, bag, '--ppr', '40', '90', '--out', tmp_path / 'out')
    assert {path: path.read_bytes() for path in (tmp_path / 'out').iterdir()} == before
    complaint(capsys, no_time(tmp_path / 'a.bag'), '--ppr', '90', '--out', tmp_path / 'none')
    assert list((tmp_path / 'none').iterdir()) == []


def test_a_reference_of_another_time_is_told(tmp_path, capsys):
    rows = [row for row in drive() if row[0] == '/joint_states']
    rows.append(('/world_pose', START_NS, ROS1.pose('geometry_msgs/msg/PoseStamped', 1, Pose2D(0.0, 0.0, 0.0))))
    run(write_ros1(tmp_path / 'a.bag', rows), '--ppr', '90')
    assert 'no pose of /world_pose has the time of an odometry message' in capsys.readouterr().err


def test_a_bag_keeps_no_index_in_memory(tmp_path):
    sample = samples_of(angles_rad(11), 90)[0]
    with ReencodedBag(tmp_path / 'long.bag', JOINTS, OdometryParams()) as bag:
        for tick in range(60_000):
            bag.encoder_pulse(tick * TICK_NS, sample._replace(stamp_ns=tick * TICK_NS))
        kept = [
            len(places)
            for chunk in bag._writer.chunks
            for places in chunk.connections.values()
            if isinstance(places, list)
        ]
        assert len(bag._writer.chunks) > 3 and len(kept) == 1
    assert len(contents(tmp_path / 'long.bag')['/encoder_pulse']) == 60_000
