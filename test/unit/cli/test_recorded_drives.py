"""The reencode command: what it reads and writes, and mistakes in one line."""

import numpy as np
import pytest

from diff_encoder_sim.api.recorded_drives import output_files
from diff_encoder_sim.cli.reencode import parse
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, chosen, load_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel
from places import CONFIG
from reencoding_drives import JOINTS, ROS1, START_NS, angles_rad, drive, write_ros1
from reencoding_runs import complaint, contents, run, samples_of
from reencoding_sources import COUNT, instants, odometry, ticks, two_topics


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


def test_rows_with_an_earlier_time_are_left_out_and_named(tmp_path, capsys):
    """Of a table that has two drives, the first is read."""
    run(*table(tmp_path / 'a.csv', [0.01 * (index % 500) for index in range(999)]))
    printed = capsys.readouterr()
    assert '500 rows' in printed.out and 'in 5.0 s' in printed.out
    assert '499 bad rows, in lines 501' in printed.err


NINETY = ChosenEncoder(PerWheel(left=90, right=90))


def test_files_are_named_by_bag_and_encoder(tmp_path):
    real = chosen(load_encoder('amt102', CONFIG, tmp_path))
    encoders = [NINETY, ChosenEncoder(PerWheel(left=40, right=1024)), real]
    files = output_files(tmp_path, tmp_path / 'drive.bag', encoders)
    names = ['drive_90ppr.bag', 'drive_40-1024ppr.bag', 'drive_8192_amt102.bag', 'reencode.csv']
    assert [path.name for path in files.values()] == names
    assert output_files(None, tmp_path / 'drive.bag', [NINETY]) == {}


def test_the_working_folder_as_a_bag_of_ros_2_gives_files_its_name(tmp_path, monkeypatch):
    (tmp_path / 'drive').mkdir()
    monkeypatch.chdir(tmp_path / 'drive')
    assert output_files(tmp_path, parse(['.']).bag, [NINETY])['90'].name == 'drive_90ppr.bag'


LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']


@pytest.fixture
def wheels_bag(tmp_path):
    return two_topics(360).write(tmp_path / 'a.bag')


@pytest.mark.parametrize(
    ('arguments', 'texts'),
    [
        ([], ['no topic of sensor_msgs/msg/JointState', '--ticks /lwheel /rwheel --ticks-per-revolution N']),
        (['--ticks', '/lwheel', '/lwheel'], ['--ticks: given /lwheel for both wheels']),
        (LEFT_RIGHT, ['--ticks-per-revolution: missing', '--robot']),
        ([*LEFT_RIGHT, '--ticks-per-revolution', '0'], ['--ticks-per-revolution: ppr: given 0']),
        (
            [*LEFT_RIGHT, '--ticks-per-revolution', '9', '--unit', 'rad'],
            ['--ticks-per-revolution: given with --unit rad'],
        ),
        ([*LEFT_RIGHT, '--ticks-modulus', '9', '--unit', 'rad'], ['--ticks-modulus: given with --unit rad']),
        ([*LEFT_RIGHT, '--seed', '9', '--unit', 'rad'], ['--seed: given 9, but nothing is random']),
        (['--ticks', '/lwheel', '/wheel', '--unit', 'rad'], ['--ticks: given /wheel', '/lwheel, /rwheel']),
        (['--odom', '/lwheel'], ['--odom: given /lwheel, which is of std_msgs/msg/Int16; allowed: it has no poses']),
        (['--odom', '/odom'], ['--odom: given /odom, which is not there']),
    ],
)
def test_mistakes_about_wheels_are_named_in_one_line(wheels_bag, capsys, arguments, texts):
    text = complaint(capsys, wheels_bag, *arguments, '--ppr', '90')
    for part in texts:
        assert part in text


def test_joints_that_are_no_wheels_are_told_what_else_could_serve(tmp_path, capsys):
    path = write_ros1(tmp_path / 'a.bag', drive(names=('arm', 'hand')) + odometry().rows)
    text = complaint(capsys, path, '--ppr', '90')
    assert "no joint 'left_wheel_joint'; expected --left, one of arm, hand; alternatives: --odom /odom" in text
    assert 'serve' not in complaint(capsys, path, '--ppr', '90', '--joint-states', '/joint_states')


def wheels_table(path, unit_ns, left_right, separator=',', header='time,left,right\n'):
    rows = (
        f'{stamp_ns / unit_ns:.9f}{separator}{left!r}{separator}{right!r}\n' for stamp_ns, left, right in left_right
    )
    path.write_text(header + ''.join(rows))
    return path


@pytest.mark.parametrize(
    ('arguments', 'unit_ns', 'convert'),
    [
        (['--unit', 'rad'], 10**9, lambda angle: angle),
        (['--unit', 'deg', '--time-unit', 'ms'], 10**6, np.degrees),
        (['--unit', 'm', '--time-unit', 'us'], 10**3, lambda angle: 0.1 * angle),
        (['--ticks-per-revolution', '1024', '--time-unit', 'ns'], 1, lambda angle: ticks(angle, 1024)),
        (['--ticks-per-revolution', '1024', '--ticks-modulus', '65536'], 10**9, lambda angle: ticks(angle, 1024, 16)),
    ],
)
def test_a_table_gives_the_same_as_a_bag(tmp_path, arguments, unit_ns, convert):
    rows = [(stamp_ns, float(convert(left)), float(convert(right))) for stamp_ns, left, right in instants()]
    path = wheels_table(tmp_path / 'a.csv', unit_ns, rows)
    run('--csv', path, '--columns', 'time', 'left', '3', *arguments, '--ppr', '64', '--out', tmp_path / 'of_table')
    expected = write_ros1(tmp_path / 'a.bag', drive(reference=None))
    run(expected, '--ppr', '64', '--out', tmp_path / 'of_bag')
    assert contents(tmp_path / 'of_table' / 'a_64ppr.bag') == contents(tmp_path / 'of_bag' / 'a_64ppr.bag')


def test_odometry_gives_the_wheels_that_made_it(tmp_path, capsys):
    run(odometry().write(tmp_path / 'a.bag'), '--odom', '/odom', '--ppr', '1000', '--out', tmp_path / 'out')
    found = contents(tmp_path / 'out' / 'a_1000ppr.bag')['/encoder_pulse']
    travel = angles_rad(COUNT) - angles_rad(COUNT)[0]
    assert len(found) == len(samples_of(travel, 1000))
    assert 'wheel angles are computed from the poses of /odom' in capsys.readouterr().err


@pytest.mark.parametrize('source', [['--odom', '/odom'], [*LEFT_RIGHT, '--unit', 'm/s']])
def test_another_seed_begins_with_other_angles(tmp_path, source):
    wheels_bag = odometry()
    wheels_bag.rows += two_topics(360).rows
    path = wheels_bag.write(tmp_path / 'a.bag')
    first = {}
    for name, seed in (('default', []), ('1', ['--seed', '1']), ('2', ['--seed', '2'])):
        run(path, *source, *seed, '--ppr', '1000', '--out', tmp_path / name)
        first[name] = contents(tmp_path / name / 'a_1000ppr.bag')['/encoder_pulse'][0]
    assert first['default'] == first['1'] != first['2']
