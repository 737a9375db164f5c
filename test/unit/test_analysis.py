"""From a bag to a table: bags are made here, so every number in them is known."""
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from diff_encoder_sim.analysis.errors import goal_errors, odometry_error, quantisation_std
from diff_encoder_sim.cli import analyze
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.experiments.definition import Trial, load_test
from diff_encoder_sim.recording.reading import read_trial
from diff_encoder_sim.se2 import Pose2D, quat_xyzw_from_yaw

ROOT = Path(__file__).resolve().parents[2]
STORE = get_typestore(Stores.ROS1_NOETIC)


def types(*names):
    return [STORE.types[name] for name in names]


POSE, POINT, QUATERNION, HEADER, TIME, TWIST, VECTOR = types(
    'geometry_msgs/msg/Pose', 'geometry_msgs/msg/Point', 'geometry_msgs/msg/Quaternion',
    'std_msgs/msg/Header', 'builtin_interfaces/msg/Time', 'geometry_msgs/msg/Twist',
    'geometry_msgs/msg/Vector3')


def trial(test='SL', number=1, **changes):
    return Trial.from_mapping({'test': load_test(test, ROOT / 'config'), 'ppr': 40,
                               'number': number, **changes}, 'test')


def pose(x_m, y_m, yaw_rad):
    return POSE(POINT(x_m, y_m, 0.0), QUATERNION(*quat_xyzw_from_yaw(yaw_rad)))


def write_bag(path, about, odom, truth, result=True):
    """A bag with poses [x, y, yaw] 50 ms apart; `about` a Trial, or the text of /trial."""
    with Writer(path) as bag:
        def put(topic, kind, stamped):
            connection = bag.add_connection(topic, kind, typestore=STORE)
            for stamp_ns, message in stamped:
                bag.write(connection, stamp_ns, STORE.serialize_ros1(message, kind))

        text = STORE.types['std_msgs/msg/String']
        if about is not None:
            put('/trial', 'std_msgs/msg/String',
                [(0, text(about if isinstance(about, str) else about.model_dump_json()))])
        put('/odom', 'nav_msgs/msg/Odometry', [(stamp, STORE.types['nav_msgs/msg/Odometry'](
            header, 'base_link',
            STORE.types['geometry_msgs/msg/PoseWithCovariance'](pose(*row), np.zeros(36)),
            STORE.types['geometry_msgs/msg/TwistWithCovariance'](
                TWIST(VECTOR(0.0, 0.0, 0.0), VECTOR(0.0, 0.0, 0.0)), np.zeros(36))))
            for stamp, header, row in stamped_rows(odom, 'odom')])
        put('/world_pose', 'geometry_msgs/msg/PoseStamped', [
            (stamp, STORE.types['geometry_msgs/msg/PoseStamped'](header, pose(*row)))
            for stamp, header, row in stamped_rows(truth, 'map')])
        if result:
            put('/trial_result', 'std_msgs/msg/String',
                [(10 ** 9, text(json.dumps({'outcome': 'succeeded', 'reason': ''})))])
    return path


def stamped_rows(rows, frame):
    for index, row in enumerate(rows):
        stamp_ns = (index + 1) * 50_000_000
        yield stamp_ns, HEADER(0, TIME(*divmod(stamp_ns, 10 ** 9)), frame), row


TRUTH = [(-10.0, 0.0, 0.0), (0.0, 0.0, 0.0), (10.0, 0.1, 0.02)]
ODOM = [(0.0, 0.0, 0.0), (10.0, 0.3, 0.01), (19.9, 0.5, 0.05)]


def test_errors_by_hand(tmp_path):
    error = odometry_error(read_trial(write_bag(tmp_path / 'a.bag', trial(), ODOM, TRUTH)))
    assert error.end_error == pytest.approx([-0.1, 0.4, 0.03])
    assert error.position_rmse_m == pytest.approx(math.sqrt((0.3 ** 2 + 0.1 ** 2 + 0.4 ** 2) / 3))
    assert error.path_length_m == pytest.approx(10 + math.hypot(10, 0.1))


def test_errors_are_along_and_across_the_start_heading(tmp_path):
    test = load_test('SL', ROOT / 'config').model_dump()
    test['start'] = {'x': 5.0, 'y': 2.0, 'yaw': math.pi / 2}
    about = trial().model_copy(update={'test': type(load_test('SL', ROOT / 'config')).from_mapping(
        test, '')})
    path = write_bag(tmp_path / 'a.bag', about, [(0, 0, 0), (3.0, 0.2, 0.1)],
                     [(5.0, 2.0, math.pi / 2), (5.0, 4.9, math.pi / 2)])
    assert odometry_error(read_trial(path)).end_error == pytest.approx([0.1, 0.2, 0.1])


def test_yaw_errors_do_not_jump_at_half_a_turn_and_turns_are_counted(tmp_path):
    yaws = np.linspace(0.0, 10 * math.pi, 200)
    about = trial('SMT')
    truth = [(-3.4, -0.85, yaw) for yaw in yaws]
    odom = [(0.0, 0.0, yaw + 0.02) for yaw in yaws]
    error = odometry_error(read_trial(write_bag(tmp_path / 'a.bag', about, odom, truth)))
    assert error.end_error[2] == pytest.approx(0.02)
    assert error.true_turn_rad == pytest.approx(10 * math.pi)


def test_only_equal_stamps_are_compared(tmp_path):
    path = write_bag(tmp_path / 'a.bag', trial(), ODOM, TRUTH[:2])  # the truth ends earlier
    assert odometry_error(read_trial(path)).end_error == pytest.approx([0.0, 0.3, 0.01])


@pytest.mark.parametrize('ppr, lateral_m, heading_deg', [
    (40, 0.321, 1.30), (90, 0.142, 0.58), (1024, 0.0125, 0.051), (4096, 0.0031, 0.013)])
def test_sigma_is_the_designs_closed_form(ppr, lateral_m, heading_deg):
    sigma = quantisation_std(trial(ppr=ppr), Pose2D(20.0, 0.0, 0.0))
    assert sigma[1] == pytest.approx(lateral_m, rel=0.02)
    assert math.degrees(sigma[2]) == pytest.approx(heading_deg, rel=0.03)


def test_goal_errors_are_in_the_goals_frame_and_odometry_counts_from_the_start(tmp_path):
    test = load_test('SL', ROOT / 'config').model_dump()
    test['start'] = {'x': 5.0, 'y': 2.0, 'yaw': math.pi / 2}
    test['route'] = [{'goal': {'x': 4.0, 'y': 5.0, 'yaw': math.pi}}]
    about = Trial.from_mapping({'test': test, 'nav': 'embedded'}, '')
    path = write_bag(tmp_path / 'a.bag', about, [(0, 0, 0), (3.0, 0.8, 1.6)],
                     [(5.0, 2.0, math.pi / 2), (4.1, 5.3, 3.0)])
    errors = goal_errors(read_trial(path))
    assert set(errors) == {'/odom', '/world_pose'}       # the others are silent
    assert errors['/odom'] == pytest.approx([-0.2, 0.0, 1.6 - math.pi / 2])
    assert errors['/world_pose'] == pytest.approx([-0.1, -0.3, 3.0 - math.pi])


def test_ideal_odometry_has_no_closed_form_error():
    assert (quantisation_std(trial(odom='ideal'), Pose2D(20.0, 0.0, 0.0)) == 0).all()


def test_the_command_prints_every_trial_and_pools_equal_cells(tmp_path, capsys):
    for number in (1, 2):
        write_bag(tmp_path / f'{number}.bag', trial(number=number), ODOM, TRUTH)
    write_bag(tmp_path / 'torn.bag', trial(number=3, ppr=90), ODOM, TRUTH, result=False)
    analyze.main([str(tmp_path)])
    printed = capsys.readouterr().out
    assert printed.count('succeeded') == 2 and printed.count('torn') == 1
    assert '/global_pose' in printed and '0.5099' in printed   # odometry ends (-0.1, 0.5) m off the goal
    assert '+0.4000' in printed and '0.3206' in printed      # y error and its sigma at 40 PPR
    pooled = printed.split('RMS x')[1].split('sigma:')[0]
    assert '0.4000' in pooled and ' 90 ' not in pooled       # one 90 PPR trial is no spread


@pytest.mark.parametrize('about, odom, truth, complaint', [
    (None, ODOM, TRUTH, 'no /trial message'),
    ('{', ODOM, TRUTH, '/trial: not JSON'),
    ('[1]', ODOM, TRUTH, 'expected a JSON object'),
    ('{"test": 3}', ODOM, TRUTH, '/trial: test: given 3'),
    (trial(), [], TRUTH, 'no message on /odom'),
    (trial(), ODOM, [], 'no message on /world_pose'),
    (trial(), [(math.nan, 0, 0)], TRUTH, '/odom: a pose is not finite')])
def test_a_bag_that_cannot_be_analysed_is_named(tmp_path, capsys, about, odom, truth, complaint):
    good = write_bag(tmp_path / 'good.bag', trial(), ODOM, TRUTH)
    bad = write_bag(tmp_path / 'bad.bag', about, odom, truth)
    with pytest.raises(SystemExit) as caught:
        analyze.main([str(bad), str(good)])
    streams = capsys.readouterr()
    assert caught.value.code == 1
    assert complaint in streams.err and streams.err.startswith(f'analyze: {bad}: ')
    assert streams.err.count('\n') == 1
    assert 'succeeded' in streams.out  # what can be analysed is


@pytest.mark.parametrize('content', [b'', b'hello', b'#ROSBAG V2.0\n', b'#ROSBAG V2.0\n' + b'x' * 5000])
def test_a_file_that_is_no_bag_is_named(tmp_path, content):
    path = tmp_path / 'bad.bag'
    path.write_bytes(content)
    with pytest.raises(ConfigError, match='bad.bag: not a readable bag') as caught:
        read_trial(path)
    assert '\n' not in str(caught.value)


def test_a_bag_cut_off_anywhere_is_named_or_read(tmp_path):
    whole = write_bag(tmp_path / 'whole.bag', trial(), ODOM, TRUTH).read_bytes()
    refused = 0
    for length in range(0, len(whole), 97):
        path = tmp_path / 'cut.bag'
        path.write_bytes(whole[:length])
        with pytest.raises(ConfigError, match='cut.bag: '):
            read_trial(path)
        refused += 1
    assert refused > 20


def test_no_bag_and_an_empty_folder_are_named(tmp_path, capsys):
    with pytest.raises(SystemExit):
        analyze.main([str(tmp_path / 'no.bag')])
    assert 'no.bag: no such bag' in capsys.readouterr().err
    with pytest.raises(SystemExit, match='no .bag file in this folder'):
        analyze.main([str(tmp_path)])
