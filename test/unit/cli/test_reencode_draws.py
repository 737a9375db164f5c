"""reencode with sampled start angles, whose spread is that of phases added by hand; tables with references."""

import json
import math

import numpy as np
import pytest

import reencoding_drives as drives
from diff_encoder_sim.api.recorded_drives import reencode
from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from drawn_drives import calibrated
from places import REAL_DRIVES
from reencoding_drives import ROS1, START_NS, angles_rad, counts_of, drive, rows_of, run, write
from trial_bags import trial

COUNTS, PPRS = 409600, (20, 40, 90, 250, 1024)
DIAMETERS_M, SEPARATION_M, PLACE, DELAY_S = (0.316, 0.3177), 0.5632, Pose2D(-0.216, 0.0, 0.0), 0.11
NAMES = 'n_time pose_x pose_y pose_theta tick_L tick_R'
TABLE = dict(columns=('n_time', 'tick_L', 'tick_R'), time_unit='ms', ticks_per_revolution=COUNTS, ppr=PPRS)
CAMERA = dict(reference_columns=('n_time', 'pose_x', 'pose_y', 'pose_theta'), length_unit='cm')
ON_ROBOT = dict(reference_pose=PLACE, reference_delay=DELAY_S)


def config(folder):
    path = folder / 'config.yaml'
    left_m, right_m = DIAMETERS_M
    path.write_text(f'wheel_diameter: {{left: {left_m}, right: {right_m}}}\nwheel_separation: {SEPARATION_M}\n')
    return path


def wheelchair(noise_m=0.01, repeated=0):
    """Rows of `NAMES` of a drive with a turn in place, a pivot and a stop; the camera lags by about a row."""
    parts = np.array([(0, 0, 5), (3, 3, 40), (-2, 2, 30), (3, 3.4, 50), (0, 2, 30), (2.5, 2, 60), (0, 0, 10)])  # rad/s
    angles = np.cumsum(0.11 * np.repeat(parts[:, :2], parts[:, 2].astype(int), axis=0), axis=0)
    pose, poses = Pose2D(1.0, -2.0, 0.7), []
    for steps_rad in np.diff(angles, axis=0, prepend=[[0.0, 0.0]]):
        left_m, right_m = 0.5 * np.array(DIAMETERS_M) * steps_rad
        pose = move_along_arc(pose, 0.5 * (left_m + right_m), (right_m - left_m) / SEPARATION_M)
        poses.append(pose.compose(PLACE))
    noise = np.random.default_rng(4).normal(0.0, noise_m, (len(poses), 3)) * (1.0, 1.0, 0.3)
    seen = np.array([poses[0], *poses[:-1]]) + noise
    times_ms = 1000 + 110 * np.arange(len(angles))
    counts = np.floor(angles * COUNTS / (2.0 * math.pi))
    rows = np.column_stack((times_ms, 100.0 * seen[:, :2], seen[:, 2], counts))
    return np.vstack((rows, rows[-1:].repeat(repeated, axis=0)))


def written(path, rows, names=NAMES):
    np.savetxt(str(path), rows, fmt='%.6f', header=names, comments='')
    return path


def real(number):
    path = REAL_DRIVES / f'wheelchair_{number}.txt'
    names = path.read_text().splitlines()[0].split()
    return np.loadtxt(str(path), skiprows=1)[:, [names.index(name) for name in NAMES.split()]]


needs_real_drives = pytest.mark.skipif(not REAL_DRIVES.exists(), reason='the drives of others are not in the project')


@pytest.mark.parametrize(
    ('rows', 'by_hand', 'options'),
    [
        (wheelchair, 30, {}),
        (wheelchair, 30, {**CAMERA, **ON_ROBOT}),
        pytest.param(lambda: real(1), 20, {**CAMERA, **ON_ROBOT}, marks=needs_real_drives),
        pytest.param(lambda: real(2), 20, {**CAMERA, **ON_ROBOT}, marks=needs_real_drives),
    ],
)
def test_the_spread_is_that_of_phases_added_to_the_counts_by_hand(tmp_path, rows, by_hand, options):
    table, given = rows(), {**TABLE, **options, 'config': config(tmp_path)}
    sampled = reencode(csv=written(tmp_path / 'a.csv', table), **given)
    offsets, found = np.random.default_rng(7).integers(0, COUNTS, (by_hand, 2)), []
    for offset in offsets:
        moved = table + np.concatenate((np.zeros(4), offset))
        found.append(reencode(csv=written(tmp_path / 'b.csv', moved), draws=1, **given))
    for index, one in enumerate(sampled):
        for name, spread in one.spreads.items():
            values = np.array([each[index].spreads[name].median for each in found])
            for quantile, fraction in zip(spread, (0.5, 0.05, 0.95)):
                below, up_to = ((values < quantile * (1 - side) - side).mean() for side in (1e-6, -1e-6))
                allowed = 3.3 * math.sqrt(fraction * (1 - fraction) * (1 / by_hand + 1 / 200)) + 1 / by_hand
                assert below - allowed <= fraction <= up_to + allowed, (one.ppr, name, quantile)


def command(folder, rows, *options):
    """The contents of --json for a table with the wheelchair's columns."""
    names = NAMES.split()
    wheels = ['--columns', names[0], *names[4:], '--time-unit', 'ms', '--ticks-per-revolution', COUNTS]
    given = ['--csv', written(folder / 'a.csv', rows), *wheels, '--config', config(folder), '--json', folder / 'a.json']
    run(*given, '--ppr', 90, 1024, *options)
    return json.loads((folder / 'a.json').read_text())


OF_CAMERA = ['--reference-columns', *NAMES.split()[:4], '--length-unit', 'cm']
ON_ROBOT_TEXT = ['--reference-pose', *PLACE, '--reference-delay', DELAY_S]


def test_a_table_is_compared_with_its_camera_where_this_is_on_the_robot(tmp_path, capsys):
    found = command(tmp_path, wheelchair(noise_m=0.0, repeated=3), *OF_CAMERA, *ON_ROBOT_TEXT)
    fine = found['encoders'][1]
    assert (found['reference'], found['draws'], found['seed'], found['repeated_rows']) == ('a.csv', 200, 0, 3)
    assert (fine['label'], fine['ppr']) == ('1024', 1024) and fine['ate_m']['p5'] < fine['ate_m']['p95'] < 0.015
    assert fine['end_yaw_rad']['p95'] < 0.005 and fine['end_position_m']['median'] < 0.01
    printed = capsys.readouterr()
    assert 'a.csv at x -0.216 m, y 0 m, yaw 0 deg on the robot, delay 0.11 s' in printed.out
    assert 'rows (ticks, 409600 a revolution) repeat a stamp: using the first of each' in printed.err
    unplaced = command(tmp_path, wheelchair(noise_m=0.0), *OF_CAMERA)['encoders'][1]
    assert unplaced['ate_m']['p5'] > 0.1


def test_positions_without_yaw_are_fitted_and_have_no_heading_errors(tmp_path, capsys):
    columns = OF_CAMERA[:4] + OF_CAMERA[5:]
    found = command(tmp_path, wheelchair(noise_m=0.0), *columns, *ON_ROBOT_TEXT)['encoders'][1]
    assert found['end_yaw_rad']['median'] is None and found['ate_m']['p95'] < 0.01
    assert 'by least squares, as this has no yaw' in capsys.readouterr().out


def test_one_draw_of_a_seed_gives_its_drive_with_bags(tmp_path, capsys):
    """The first of several draws has the same bags."""
    table = wheelchair()
    for name, options in (('one', ['--draws', 1]), ('all', []), ('other', ['--draws', 1, '--seed', 4])):
        seed = [] if '--seed' in options else ['--seed', 3]
        command(tmp_path, table, *options, *seed, '--out', tmp_path / name)
    counts = [counts_of(tmp_path / name / 'a_90ppr.bag') for name in ('one', 'all', 'other')]
    assert counts[0] == counts[1] != counts[2]
    rows = [rows_of(tmp_path / name)[0] for name in ('one', 'all')]
    assert rows[0]['ate_rmse_m'] == rows[0]['ate_p5_m'] == rows[0]['ate_p95_m'] == rows[1]['ate_rmse_m']
    assert float(rows[1]['ate_p5_m']) < float(rows[1]['ate_median_m']) < float(rows[1]['ate_p95_m'])
    assert capsys.readouterr().err.count('the bags contain the first of 200 draws') == 1


def test_the_calibration_in_the_robot_file_places_the_reference(tmp_path):
    content = calibrated().model_dump(exclude_none=True)
    for name, value in (('x_m', PLACE.x_m), ('y_m', 0.0), ('yaw_rad', 0.0), ('delay_s', DELAY_S)):
        content[f'reference_{name}'] = {'value': value, 'interval': [value, value]}
    robot = tmp_path / 'robot.yaml'
    left_m, right_m = DIAMETERS_M
    wheels = {'config.wheel_diameter': {'left': left_m, 'right': right_m}, 'config.wheel_separation': SEPARATION_M}
    robot.write_text(json.dumps({'calibration': content, 'set': wheels}))
    table = written(tmp_path / 'a.csv', wheelchair(noise_m=0.0))
    [found] = reencode(csv=table, **{**TABLE, **CAMERA, 'robot': str(robot), 'ppr': 1024})
    [given] = reencode(csv=table, **{**TABLE, **CAMERA, **ON_ROBOT, 'config': config(tmp_path), 'ppr': 1024})
    assert found.spreads == given.spreads


def test_counts_of_a_trial_are_exact_unless_draws_are_given(tmp_path, capsys):
    joints = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    rows = [('/trial', START_NS, ROS1.text(trial(**joints, ppr=1024).model_dump_json()))]
    samples = drives.samples_of(angles_rad(501), 1024)
    rows += [('/encoder_pulse', stamp_ns, ROS1.pulses(stamp_ns, counts)) for stamp_ns, *counts, _ in samples]
    path = write(tmp_path / 'a.bag', rows)
    run(path, '--ppr', '64')
    assert 'sampled' not in capsys.readouterr().out
    run(path, '--ppr', '64', '--draws', 20)
    assert 'start angles of the wheels: 20 sampled by --seed' in capsys.readouterr().out


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (['--seed', 3], '--seed: given 3, but nothing is random; allowed: with --draws'),
        (['--draws', 0, '--seed', 3], '--seed: given 3, but nothing is random'),
        (['--reference-delay', 0.1], 'given without a reference'),
        (['--json', '/proc/none/a.json'], '/proc/none/a.json'),
    ],
)
def test_options_without_effect_are_refused(tmp_path, capsys, arguments, text):
    path = write(tmp_path / 'a.bag', drive(reference=None))
    assert text in drives.complaint(capsys, path, '--ppr', '90', *arguments)


@pytest.mark.parametrize('arguments', [['--encoder', 'amt102'], ['--ppr', '90', '--draws', 2]])
def test_a_seed_is_used_if_something_is_random(tmp_path, capsys, arguments):
    path, tables = write(tmp_path / 'a.bag', drive()), []
    for seed in (1, 2):
        run(path, *arguments, '--seed', seed)
        tables.append(capsys.readouterr().out.partition('counts')[2])
    assert tables[0] != tables[1]
