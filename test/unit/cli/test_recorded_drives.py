"""The reencode command: inputs and outputs, recorded counts, and mistakes in one line."""

import numpy as np
import pytest

import reencoding_drives as drives
from diff_encoder_sim.api.recorded_drives import output_files
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.cli.reencode import parse
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, load_encoder
from diff_encoder_sim.wheels.counter import wrap_count
from places import CONFIG
from reencoding_drives import JOINTS, ROS1, START_NS, angles_rad, contents, counts_of, drive, run, samples_of, write
from reencoding_sources import instants, odometry, ticks, two_topics
from trial_bags import trial

LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']
PPR = 1024
ANGLES_RAD = angles_rad(2001)
SAMPLES = samples_of(ANGLES_RAD, PPR)
TURNED = (ANGLES_RAD[-1] - ANGLES_RAD[0]) / (2.0 * np.pi)  # left, right


@pytest.fixture
def bag(tmp_path):
    return write(tmp_path / 'drive.bag', drive())


def no_time():
    return [('/joint_states', START_NS + tick, ROS1.joint_state(0, (0.1, 0.2))) for tick in range(300)]


def two_robots():
    return drive() + drive(joint_topic='/robot2/joint_states', reference=None)


def other_joints():
    return drive(names=('arm', 'hand')) + odometry().rows


@pytest.mark.parametrize(
    ('make', 'arguments', 'texts'),
    [
        (list, [], ['no such bag']),
        (two_robots, [], ['/joint_states, /robot2/joint_states', '--joint-states']),
        (lambda: [('/fine', START_NS, ROS1.pulses(START_NS, [1, 2]))], [], ['/fine', '--pulses-ppr']),
        (no_time, [], ['/joint_states', 'stamps do not advance']),
        (lambda: drive()[:1], [], ['/joint_states', 'no drive', 'too short']),
        (lambda: drive(names=('a', 'b')), [], ['/joint_states', '--left', 'a, b']),
        (other_joints, [], ["no joint 'left_wheel_joint'", '--left, one of arm, hand; alternatives: --odom /odom']),
        (lambda: drive()[1:2], [], ['no topic of sensor_msgs/msg/JointState', '/world_pose']),
        (drive, ['--joint-states', '/world_pose'], ['PoseStamped', '/joint_states']),
        (drive, ['--pulses-ppr', '1024'], ['--pulses-ppr', '/joint_states has wheel angles', '--pulses TOPIC']),
        (drive, ['--left', 'arm'], ["'arm'", ', '.join(JOINTS)]),
        (drive, ['--left', JOINTS[1]], ['both wheels']),
        (drive, ['--reference', '/odom'], ['/odom', 'not there', '/world_pose']),
        (drive, ['--reference', '/joint_states'], ['JointState', '/world_pose']),
        (drive, ['--reference', 'map->'], ["'map->'", 'two frames']),
        (drive, ['--ppr', '0'], ['--ppr', '0', '0.001 to 1e9']),
        (drive, ['--config', 'no.yaml'], ['no.yaml', 'cannot be read']),
        (drive, ['--out', '/proc/out'], ['/proc/out']),
        (two_topics, [], ['no topic of sensor', '--ticks /lwheel /rwheel --ticks-per-revolution N']),
        (two_topics, ['--ticks', '/lwheel', '/lwheel'], ['--ticks: given /lwheel for both wheels']),
        (two_topics, LEFT_RIGHT, ['--ticks-per-revolution: missing', '--robot']),
        (two_topics, [*LEFT_RIGHT, '--ticks-per-revolution', '0'], ['--ticks-per-revolution: ppr: given 0']),
        (two_topics, ['--odom', '/lwheel'], ['--odom: given /lwheel', 'std_msgs/msg/Int16; allowed: it has no poses']),
    ],
)
def test_mistakes_are_named_in_one_line(tmp_path, capsys, make, arguments, texts):
    rows = make(360).rows if make is two_topics else make()
    if rows:
        write(tmp_path / 'a.bag', rows)
    ppr = [] if '--ppr' in arguments else ['--ppr', '90']
    text = drives.complaint(capsys, tmp_path / 'a.bag', *ppr, *arguments)
    for part in texts:
        assert part in text


def test_nothing_is_overwritten_and_nothing_unfinished_is_left(tmp_path, bag, capsys):
    run(bag, '--ppr', '90', '--out', tmp_path / 'out')
    before = {path: path.read_bytes() for path in (tmp_path / 'out').iterdir()}
    assert 'drive_90ppr.bag exists' in drives.complaint(capsys, bag, '--ppr', '40', '90', '--out', tmp_path / 'out')
    assert {path: path.read_bytes() for path in (tmp_path / 'out').iterdir()} == before
    drives.complaint(capsys, write(tmp_path / 'a.bag', no_time()), '--ppr', '90', '--out', tmp_path / 'none')
    assert list((tmp_path / 'none').iterdir()) == []


def test_files_are_named_by_bag_and_encoder(tmp_path, monkeypatch):
    ninety, real = ChosenEncoder(PerWheel(left=90, right=90)), load_encoder('amt102', CONFIG, tmp_path)
    encoders = [ninety, ChosenEncoder(PerWheel(left=40, right=1024)), real]
    files = output_files(tmp_path, tmp_path / 'drive.bag', encoders)
    names = ['drive_90ppr.bag', 'drive_40-1024ppr.bag', 'drive_8192_amt102.bag', 'reencode.csv', 'drive.html']
    assert [path.name for path in files.values()] == names
    assert output_files(None, tmp_path / 'drive.bag', [ninety]) == {}
    (tmp_path / 'drive').mkdir()
    monkeypatch.chdir(tmp_path / 'drive')
    assert output_files(tmp_path, parse(['.']).bag, [ninety])['90'].name == 'drive_90ppr.bag'


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
def test_a_table_gives_the_same_as_a_bag(tmp_path, bag, arguments, unit_ns, convert):
    rows = ['time,left,right']
    rows += [f'{stamp_ns / unit_ns:.9f},{convert(left)!s},{convert(right)!s}' for stamp_ns, left, right in instants()]
    path = tmp_path / 'drive.csv'
    path.write_text('\n'.join(rows))
    given = ['--csv', path, '--columns', 'time', 'left', '3', *arguments]
    run(*given, '--ppr', '64', '--draws', 0, '--out', tmp_path / 'of_table')
    run(bag, '--ppr', '64', '--out', tmp_path / 'of_bag')
    found, expected = (contents(tmp_path / out / 'drive_64ppr.bag') for out in ('of_table', 'of_bag'))
    assert found == {topic: messages for topic, messages in expected.items() if topic != '/world_pose'}


def test_rows_with_an_earlier_time_are_left_out_and_named(tmp_path, capsys):
    """Of a table with two drives, the first is read."""
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(f'{0.01 * (index % 500)},{0.04 * index},{0.05 * index}' for index in range(999)))
    run('--csv', path, '--columns', '1', '2', '3', '--unit', 'rad', '--ppr', '90')
    printed = capsys.readouterr()
    assert '500 rows' in printed.out and 'in 5.0 s' in printed.out
    assert '499 bad rows, in lines 501' in printed.err


@pytest.mark.parametrize('source', [['--odom', '/odom'], [*LEFT_RIGHT, '--unit', 'm/s']])
def test_another_seed_begins_with_other_angles(tmp_path, source):
    path = write(tmp_path / 'a.bag', odometry().rows + two_topics(360).rows)
    first = {}
    for name, seed in (('default', []), ('0', ['--seed', '0']), ('2', ['--seed', '2'])):
        run(path, *source, *seed, '--ppr', '1000', '--out', tmp_path / name)
        first[name] = counts_of(tmp_path / name / 'a_1000ppr.bag')[0]
    assert first['default'] == first['0'] != first['2']


def counted(path, counts=None, modulus=0, **changes):
    """A bag of a trial with counts at 1024 PPR."""
    joints = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    about = trial(**joints, **{'ppr': PPR, 'counter_modulus': modulus, **changes})
    counts = counts or [[wrap_count(count, modulus) for count in sample[1:3]] for sample in SAMPLES]
    rows = [('/trial', START_NS, ROS1.text(about.model_dump_json()))]
    rows += [('/encoder_pulse', sample[0], ROS1.pulses(sample[0], pair)) for sample, pair in zip(SAMPLES, counts)]
    return write(path, rows)


def turned(folder, label):
    """Revolutions of both wheels in the written bag, in pulses."""
    first, *_, last = counts_of(next(folder.glob(f'*_{label}ppr.bag')))
    return np.subtract(last, first)


def test_counts_wrap_as_in_the_bags_trial_and_computed_ones_do_not(tmp_path, capsys):
    run(counted(tmp_path / 'narrow.bag', modulus=512), '--ppr', '64', '65536', '--out', tmp_path / 'out')
    printed = capsys.readouterr()
    assert "counts wrap at 512: the bag's /trial" in printed.out and printed.err == ''
    assert f'recorded with {PPR} counts: 65536 limited by the recorded resolution' in printed.out
    for ppr in (64, 65536):
        assert turned(tmp_path / 'out', ppr) == pytest.approx(TURNED * ppr, abs=1 + ppr / PPR)


def test_a_reencoded_bag_contains_the_modulus_of_its_counts(tmp_path, capsys):
    config = tmp_path / 'config.yaml'
    config.write_text('counter_modulus: 512\n')
    run(counted(tmp_path / 'a.bag'), '--ppr', '1024', '--config', config, '--out', tmp_path / 'narrow')
    run(next((tmp_path / 'narrow').glob('*.bag')), '--ppr', '1024', '--out', tmp_path / 'again')
    printed = capsys.readouterr()
    assert f'counts wrap at 512: {config}' in printed.out and "counts wrap at 512: the bag's /trial" in printed.out
    assert 'restart' not in printed.err and 'limited' not in printed.out
    assert turned(tmp_path / 'again', 1024) == pytest.approx(TURNED * PPR, abs=1)


def test_restarts_are_no_motion_and_reported_once(tmp_path, capsys):
    middle = len(SAMPLES) // 2
    counts = [sample[1:3] for sample in SAMPLES[:middle]]
    counts += [np.subtract(sample[1:3], SAMPLES[middle][1:3]).tolist() for sample in SAMPLES[middle:]]
    run(counted(tmp_path / 'a.bag', counts), '--ppr', '64', '128', '--out', tmp_path / 'out')
    [line] = capsys.readouterr().err.splitlines()
    assert '/encoder_pulse: counter restarts: 1;' in line
    assert turned(tmp_path / 'out', 128) == pytest.approx(128 * TURNED * (1 - 1 / len(SAMPLES)), abs=2)


@pytest.mark.parametrize(
    ('changes', 'name'),
    [({'encoder': 'hoverboard_hub'}, ' hoverboard_hub'), ({'variant': 'missed'}, ', variant missed')],
)
def test_counts_have_the_errors_of_their_encoder(tmp_path, capsys, changes, name):
    run(counted(tmp_path / 'a.bag', **changes), '--ppr', '64')
    note = f'reencode: {tmp_path / "a.bag"}: the angles are counts of 1024{name}, with its errors'
    assert capsys.readouterr().err.strip() == note
