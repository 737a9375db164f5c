"""The reencode command: mistakes in one line, and files that are not overwritten."""

import pytest

from reencoding_drives import JOINTS, ROS1, START_NS, drive, write_ros1
from reencoding_runs import complaint, run


@pytest.fixture
def bag(tmp_path):
    return write_ros1(tmp_path / 'drive.bag', drive())


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
        (no_time, [], ['/joint_states', 'stamps do not advance']),
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
        (whole, ['--ppr', '0'], ['--ppr', '0', '0.001 to 1e9']),
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


CSV = ['--columns', '1', '2', '3', '--unit', 'rad', '--ppr', '90']


def table(path, times):
    path.write_text('\n'.join(f'{time},{0.04 * index},{0.05 * index}' for index, time in enumerate(times)))
    return ['--csv', path, *CSV]


def test_a_table_with_decreasing_times_is_refused(tmp_path, capsys):
    text = complaint(capsys, *table(tmp_path / 'a.csv', [10.0 - 0.01 * index for index in range(990)]))
    assert 'a.csv' in text and '989 bad rows' in text and 'decrease' in text


def test_rows_with_an_earlier_time_are_left_out_and_named(tmp_path, capsys):
    """Of a table that has two drives, the first is read."""
    run(*table(tmp_path / 'a.csv', [0.01 * (index % 500) for index in range(999)]))
    printed = capsys.readouterr()
    assert '500 rows' in printed.out and 'in 5.0 s' in printed.out
    assert '499 bad rows, in lines 501' in printed.err


def test_the_duration_of_a_bag_whose_clock_was_set_back_is_not_negative(tmp_path, capsys):
    rows = drive()
    later_ns = 10**10
    first = [(topic, now_ns + later_ns, message) for topic, now_ns, message in rows[:-10]]
    run(write_ros1(tmp_path / 'a.bag', [*first, *rows[-10:]]), '--ppr', '90')
    assert ' in -' not in capsys.readouterr().out
