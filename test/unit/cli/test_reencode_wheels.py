"""Which source of wheel angles reencode takes, and what it says of it."""

import numpy as np
import pytest

from reencoding_drives import angles_rad, drive, write_ros1
from reencoding_runs import complaint, contents, rows_of, run, samples_of
from reencoding_sources import COUNT, instants, kobuki, odometry, ticks, two_topics

LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']
COLUMNS = ['--columns', '1', '2', '3']


@pytest.fixture
def bag(tmp_path):
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
        ([*LEFT_RIGHT, '--seed', '9', '--unit', 'rad'], ['--seed: given 9, but nothing is drawn']),
        (['--ticks', '/lwheel', '/wheel', '--unit', 'rad'], ['--ticks: given /wheel', '/lwheel, /rwheel']),
        (['--odom', '/lwheel'], ['--odom: given /lwheel, which is of std_msgs/msg/Int16; allowed: it has no poses']),
        (['--odom', '/odom'], ['--odom: given /odom, which is not there']),
    ],
)
def test_mistakes_are_named_in_one_line(bag, capsys, arguments, texts):
    text = complaint(capsys, bag, *arguments, '--ppr', '90')
    for part in texts:
        assert part in text


def test_joints_that_are_no_wheels_are_told_what_else_could_serve(tmp_path, capsys):
    path = write_ros1(tmp_path / 'a.bag', drive(names=('arm', 'hand')) + odometry().rows)
    text = complaint(capsys, path, '--ppr', '90')
    assert "no joint 'left_wheel_joint'; expected --left, one of arm, hand; what else could serve: --odom /odom" in text
    assert 'serve' not in complaint(capsys, path, '--ppr', '90', '--joint-states', '/joint_states')


def test_speeds_of_joints_serve_where_they_have_no_angles(tmp_path, capsys):
    rows = drive(reference=None)
    for _, _, message in rows:
        message.position, message.velocity = np.zeros(0), np.array([4.0, 4.4])
    path = write_ros1(tmp_path / 'a.bag', rows)
    assert 'has no position' in complaint(capsys, path, '--ppr', '90')
    run(path, '--ticks', '/joint_states.velocity[0]', '/joint_states.velocity[1]', '--unit', 'rad/s', '--ppr', '90')
    assert '501 messages of /joint_states.velocity[0]' in capsys.readouterr().out


def test_a_table_has_no_poses(tmp_path, capsys):
    (tmp_path / 'a.csv').write_text('1,2,3\n2,3,4\n')
    text = complaint(capsys, '--csv', tmp_path / 'a.csv', *COLUMNS, '--unit', 'rad', '--reference', '/odom')
    assert '--reference: given with --csv' in text


def table(path, unit_ns, left_right, separator=',', header='time,left,right\n'):
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
    path = table(tmp_path / 'a.csv', unit_ns, rows)
    run('--csv', path, '--columns', 'time', 'left', '3', *arguments, '--ppr', '64', '--out', tmp_path / 'of_table')
    expected = write_ros1(tmp_path / 'a.bag', drive(reference=None))
    run(expected, '--ppr', '64', '--out', tmp_path / 'of_bag')
    assert contents(tmp_path / 'of_table' / 'a_64ppr.bag') == contents(tmp_path / 'of_bag' / 'a_64ppr.bag')


def test_bad_rows_of_a_table_are_named(tmp_path, capsys):
    path = table(tmp_path / 'a.csv', 10**9, instants())
    lines = path.read_text().splitlines()
    lines[16] = 'oops'
    path.write_text('\n'.join(lines))
    run('--csv', path, *COLUMNS, '--unit', 'rad', '--ppr', '90')
    captured = capsys.readouterr()
    assert '1 bad rows, in lines 17; the first' in captured.err
    assert 'a.csv: 500 rows (rad) in 5.0 s' in captured.out


def test_odometry_gives_the_wheels_that_made_it(tmp_path, capsys):
    run(odometry().write(tmp_path / 'a.bag'), '--odom', '/odom', '--ppr', '1000', '--out', tmp_path / 'out')
    found = contents(tmp_path / 'out' / 'a_1000ppr.bag')['/encoder_pulse']
    travel = angles_rad(COUNT) - angles_rad(COUNT)[0]
    assert len(found) == len(samples_of(travel, 1000))
    assert 'wheel angles are computed from the poses of /odom' in capsys.readouterr().err


def test_odometry_compared_with_itself_differs_by_the_new_rounding_alone(tmp_path):
    path = odometry().write(tmp_path / 'a.bag')
    run(path, '--odom', '/odom', '--reference', '/odom', '--ppr', '90', '100000', '--out', tmp_path / 'out')
    coarse, fine = rows_of(tmp_path / 'out')
    assert float(fine['ate_max_m']) < 1e-4 < float(coarse['ate_max_m']) < 0.05


@pytest.mark.parametrize('source', [['--odom', '/odom'], [*LEFT_RIGHT, '--unit', 'm/s']])
def test_another_seed_begins_with_other_angles(tmp_path, source):
    bag = odometry()
    bag.rows += two_topics(360).rows
    path = bag.write(tmp_path / 'a.bag')
    first = {}
    for name, seed in (('default', []), ('1', ['--seed', '1']), ('2', ['--seed', '2'])):
        run(path, *source, *seed, '--ppr', '1000', '--out', tmp_path / name)
        first[name] = contents(tmp_path / name / 'a_1000ppr.bag')['/encoder_pulse'][0]
    assert first['default'] == first['1'] != first['2']


def test_what_is_finer_than_the_recording_is_said_to_show_no_more(tmp_path, bag, capsys):
    run(bag, *LEFT_RIGHT, '--ticks-per-revolution', '360', '--ppr', '90', '360', '1024', '4096')
    assert 'recorded with 360 PPR: 1024, 4096 limited by the recorded resolution' in capsys.readouterr().out
    run(bag, *LEFT_RIGHT, '--ticks-per-revolution', '360', '--ppr', '90', '360')
    assert 'cannot show' not in capsys.readouterr().out


def test_the_robot_says_how_many_ticks_a_revolution_has(tmp_path, capsys):
    path = kobuki().write(tmp_path / 'a.bag')
    sides = ['/mobile_base/sensors/core.left_encoder', '/mobile_base/sensors/core.right_encoder']
    run(path, '--ticks', *sides, '--robot', 'kobuki', '--ppr', '90')
    out = capsys.readouterr().out
    assert '(ticks, 2578.33 a revolution, the counter wraps at 65536)' in out and 'separation 0.23 m' in out
