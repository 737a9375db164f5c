"""The calibrate command: from drives with a reference, squares and scans to robot file, JSON, page and text."""

import contextlib
import hashlib
import io
import json

import numpy as np
import pytest
import yaml

from browser import NEEDS_BROWSER, opened_page
from diff_encoder_sim import api
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.calibration.calibration_tables import prediction_note
from diff_encoder_sim.calibration.estimation import Disturbance
from diff_encoder_sim.calibration.prediction import Prediction
from diff_encoder_sim.calibration.umbmark import LENGTHS, WheelGeometry
from diff_encoder_sim.cli import calibrate
from diff_encoder_sim.trials.robot_params import load_numbers, load_robot_config, override
from lockstep_trials import ALTO, params_of, plan_of, run_trial
from places import CONFIG, REAL_DRIVES, ROOT

LEFT_M, RIGHT_M, SEPARATION_M = 0.2006, 0.1994, 0.41
TRUE = WheelGeometry(LEFT_M, RIGHT_M, SEPARATION_M)
SENSOR_X_M, SENSOR_Y_M, SENSOR_YAW_RAD, DELAY_S = -0.15, 0.04, 0.2, 0.08
COUNTS = 4096
NOMINAL = {'config.wheel_diameter': 0.2, 'config.wheel_separation': 0.4}
COLUMNS = {'columns': ('t', 'left', 'right'), 'reference_columns': ('t', 'x', 'y', 'yaw')}
COLUMNS['ticks_per_revolution'] = COUNTS
TABLE = f'--columns t left right --ticks-per-revolution {COUNTS} --reference-columns t x y yaw'.split()


def table(path, seed, turns=True):
    """Write 1 min of a drive: counts of wheels, and poses of a camera behind the axle that is late."""
    rng, times_s = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.05)
    yaw_rates_radps = turns * 0.6 * np.sin(2.0 * np.pi * times_s / 23.0 + seed) * (np.abs(np.sin(times_s / 11.0)) > 0.3)
    speeds_mps = 0.3 * np.clip(np.minimum(times_s - 1.0, 59.0 - times_s), 0.0, 1.0)
    rims_mps = np.outer(yaw_rates_radps, [-0.5 * SEPARATION_M, 0.5 * SEPARATION_M])
    angles_rad = np.cumsum((speeds_mps[:, np.newaxis] + rims_mps) * 0.05, axis=0) / TRUE.radii_m
    poses = TRUE.path(angles_rad)
    late_s = times_s - DELAY_S
    x_m, y_m, yaw_rad = (np.interp(late_s, times_s, column) for column in (*poses[:, :2].T, np.unwrap(poses[:, 2])))
    x_m += SENSOR_X_M * np.cos(yaw_rad) - SENSOR_Y_M * np.sin(yaw_rad) + rng.normal(0.0, 0.003, len(x_m))
    y_m += SENSOR_X_M * np.sin(yaw_rad) + SENSOR_Y_M * np.cos(yaw_rad) + rng.normal(0.0, 0.003, len(x_m))
    yaw_rad += SENSOR_YAW_RAD + rng.normal(0.0, 0.004, len(x_m))
    counts = np.floor(angles_rad * COUNTS / (2.0 * np.pi)).astype(int)
    rows = zip(times_s, *counts.T, x_m, y_m, yaw_rad)
    path.write_text('t,left,right,x,y,yaw\n' + '\n'.join(','.join(f'{each:.9g}' for each in row) for row in rows))
    return path


def robot_file(path, **settings):
    path.write_text(yaml.safe_dump({'set': {**NOMINAL, **settings}}))
    return str(path)


@pytest.fixture(name='done', scope='module')
def fixture_done(tmp_path_factory):
    """The folder of a calibration by two drives, and its text."""
    folder = tmp_path_factory.mktemp('calibrated')
    tables = [str(table(folder / f'drive_{seed}.csv', seed)) for seed in (1, 2)]
    written = f'--robot {robot_file(folder / "nominal.yaml")} --out {folder / "r.yaml"} --json {folder / "r.json"}'
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        calibrate.main(['--csv', *tables, *TABLE, *written.split()])
    return folder, printed.getvalue()


def test_the_json_has_the_values_with_intervals_and_the_drives(done):
    folder, _ = done
    content = json.loads((folder / 'r.json').read_text())
    true = {
        **dict(zip(LENGTHS, TRUE)),
        'reference_x_m': SENSOR_X_M,
        'reference_y_m': SENSOR_Y_M,
        'reference_yaw_rad': SENSOR_YAW_RAD,
        'reference_delay_s': DELAY_S,
        'radius_ratio': RIGHT_M / LEFT_M,
        'radius_per_separation': 0.5 * LEFT_M / SEPARATION_M,
    }
    for name, value in true.items():
        low, high = content[name]['interval']
        half = 0.5 * (high - low)
        assert low <= content[name]['value'] <= high and abs(content[name]['value'] - value) < 2.0 * half, name
    assert content['radius_ratio']['value'] == pytest.approx(RIGHT_M / LEFT_M, abs=3e-4)
    digests = [hashlib.sha256((folder / f'drive_{seed}.csv').read_bytes()).hexdigest() for seed in (1, 2)]
    assert [each['sha256'] for each in content['drives']] == digests
    controller = content['diff_drive_controller']
    assert controller['wheel_separation_multiplier'] == pytest.approx(SEPARATION_M / 0.4, rel=5e-3)
    assert (content['undetermined'], len(content['predictions']), content['amcl']['odom_model_type']) == ([], 2, 'diff')
    assert {'bias', 'std', 'error', 'interval', 'is_inside', 'nominal_error'} < {*content['predictions'][0]}


def test_the_robot_file_is_that_of_the_json_and_other_commands_read_it(done):
    folder, _ = done
    content = json.loads((folder / 'r.json').read_text())
    file, settings = load_numbers('r.yaml', folder, ROOT, {})
    params = override(load_robot_config(CONFIG), settings)
    assert params.odometry.wheel_diameter.left == pytest.approx(content['left_wheel_diameter_m']['value'])
    assert params.odometry.wheel_separation == pytest.approx(content['wheel_separation_m']['value'])
    assert params.odometry.motion_noise == pytest.approx(content['slip_m2_per_m']['value'])
    assert params.amcl.odom_alpha2 == content['amcl']['odom_alpha2']
    assert file.ppr == COUNTS and file.calibration.drives[1].file == str(folder / 'drive_2.csv')
    reference = {'csv': folder / 'drive_1.csv', **COLUMNS}
    assert api.reencode(robot=str(folder / 'r.yaml'), ppr=[COUNTS], draws=1, **reference)[0].error.ate_rmse_m < 0.05


def test_the_text_and_the_page_say_how_well_the_robot_is_known(done):
    folder, text = done
    for part in ('ratio of radii to 0.0', 'left_wheel_radius_multiplier: 1.00', 'odom_alpha4', 'r_ros2.yaml'):
        assert part in text
    ros1, ros2 = (yaml.safe_load((folder / f'r_{version}.yaml').read_text()) for version in ('ros1', 'ros2'))
    controller = json.loads((folder / 'r.json').read_text())['diff_drive_controller']
    assert ros1['diff_drive_controller'] == ros2['diff_drive_controller']['ros__parameters'] == controller
    page = (folder / 'calibration.html').read_text(encoding='utf-8')
    assert all(f'id="chart-{name}"' in page for name in ('path', 'residuals', 'ellipses', 'prediction'))
    assert 'atio of radii to 0.0' in page and str(folder / 'r.yaml') in text


def test_slip_by_motion_is_in_text_json_and_robot_file_if_asked_for(tmp_path, capsys):
    options = f'--robot {robot_file(tmp_path / "n.yaml")} --out {tmp_path / "r.yaml"} --json {tmp_path / "r.json"}'
    calibrate.main(['--slip-by-motion', '--csv', str(table(tmp_path / 'drive.csv', 1)), *TABLE, *options.split()])
    assert 'Slip by motion' in capsys.readouterr().out
    name = 'slip_by_lateral_acceleration'
    found = json.loads((tmp_path / 'r.json').read_text())[name]['value']
    file, settings = load_numbers('r.yaml', tmp_path, ROOT, {})
    assert file.calibration.slip_by_lateral_acceleration.value == found
    assert settings['simulator.wheel_errors.slip.lateral_acceleration'] == found


@NEEDS_BROWSER
def test_the_page_is_not_cut_on_a_phone(done, tmp_path):
    with opened_page(tmp_path) as page:
        page.open(done[0] / 'calibration.html', 390)
        page.wait_for('document.querySelectorAll(".charts.drawn figure svg").length === 4')
        assert page.evaluate('document.documentElement.scrollWidth') <= 390
        assert page.cut_texts() == page.complaints() == []


def test_a_straight_line_does_not_determine_the_separation_which_stays_nominal_or_unknown(tmp_path):
    path = table(tmp_path / 'straight.csv', 1, turns=False)
    options = {'csv': [path], **COLUMNS}
    nominal = robot_file(tmp_path / 'nominal.yaml')
    found = api.calibrate(robot=nominal, out=tmp_path / 'r.yaml', json=tmp_path / 'r.json', **options)
    assert 'wheel_separation_m' in found.undetermined
    assert load_numbers('r.yaml', tmp_path, ROOT, {})[1]['config.wheel_separation'] == 0.4
    controller = json.loads((tmp_path / 'r.json').read_text())['diff_drive_controller']
    assert controller['wheel_separation_multiplier'] == 1.0
    api.calibrate(out=tmp_path / 'r.yaml', json=tmp_path / 'r.json', **options)
    assert 'config.wheel_separation' not in load_numbers('r.yaml', tmp_path, ROOT, {})[1]
    assert json.loads((tmp_path / 'r.json').read_text())['diff_drive_controller'] == {}


@pytest.mark.parametrize(('options', 'error'), [
    ({'odom': '/odom'}, '--odom: given /odom, but angles computed from odometry contain the very geometry'),
    ({'csv': []}, 'BAG, --csv: given neither'),
    ({'reference_columns': ()}, 'drive.csv: no reference; expected --reference-columns'),
    ({'reference_csv': ['a.csv', 'b.csv']}, '--reference-csv: given 2 tables for 1 drives'),
    ({'out': 'r.txt'}, '--out: given r.txt; allowed: a name that ends in .yaml or .yml'),
    ({'out': 'drive.yaml'}, '--out: given drive.yaml, which calibrate has not written'),
    ({'json': 'none/r.json'}, "--json: given 'none/r.json'; allowed: a file in a folder that exists"),
    ({'unit': 'm', 'ticks_per_revolution': ''}, '--unit: given m without the diameter'),
    ({'ends': 'ends.csv'}, '--ends: given ends.csv; allowed: with --umbmark, in place of drives'),
    ({'umbmark': True}, '--robot: missing; expected the robot, whose nominal geometry UMBmark corrects'),
    ({'reference': 'scan'}, '--reference: given with --reference-columns'),
])  # fmt: skip
def test_mistakes_are_named_in_one_line(tmp_path, monkeypatch, options, error):
    monkeypatch.chdir(tmp_path)
    table(tmp_path / 'drive.csv', 1)
    robot_file(tmp_path / 'drive.yaml')
    with pytest.raises(ConfigError) as refused:
        api.calibrate(**{'csv': ['drive.csv'], **COLUMNS, **options})
    assert error in str(refused.value)


AROUND = {
    'name': 'around',
    'world': 'ros_logo',
    'start': {'x': -3.4, 'y': -0.85},
    'path': [{'straight': 0.8}, {'turns': 0.5}, {'straight': 0.8}, {'turns': -0.5}],
}


def test_the_laser_may_be_the_reference_and_bags_of_other_wheels_are_refused(tmp_path):
    bags = []
    for path, separation_m, record in ((AROUND['path'], 0.4, 'full'), ([{'straight': 0.2}], 0.42, 'minimal')):
        bags.append(tmp_path / f'{separation_m}.bag')
        plan = plan_of({**AROUND, 'path': path}, 1024, nav='scripted', bag=bags[-1])
        trial = plan.trial.model_copy(update={'wheel_separation': separation_m})
        run_trial(plan.model_copy(update={'trial': trial}), ALTO, params_of(), record)
    found = api.calibrate(bags[:1], reference='scan')
    low, high = found.values['radius_per_separation'].interval
    assert 0.25 - (high - low) < found.values['radius_per_separation'].value < 0.25 + (high - low) < 0.3
    with pytest.raises(ConfigError, match='given robots with different wheels; allowed: drives of one robot'):
        api.calibrate(bags)


def test_squares_of_a_bag_give_the_separation(tmp_path):
    side, turns = {'straight': 1.0}, [{'turns': 0.25}, {'turns': -0.25}]
    path = [each for turn in turns for each in [side, turn] * 4]
    plan = plan_of({**AROUND, 'world': 'open_floor', 'path': path}, 1024, nav='scripted', bag=tmp_path / 'squares.bag')
    params = params_of()
    errors = params.simulator.wheel_errors.model_copy(update={'wheel_separation_error': 0.02})
    simulator = params.simulator.model_copy(update={'wheel_errors': errors})
    run_trial(plan, ALTO, params._replace(simulator=simulator), 'minimal')
    found = api.calibrate([tmp_path / 'squares.bag'], umbmark=True, out=tmp_path / 'r.yaml')
    assert found.squares == (1, 1)
    assert (found.e_b, found.e_d) == pytest.approx((1.02, 1.0), abs=2e-3)
    assert found.e_max_m[1] < 0.1 * found.e_max_m[0]
    settings = load_numbers('r.yaml', tmp_path, ROOT, {})[1]
    assert settings['config.wheel_separation'] == pytest.approx(0.408, abs=1e-3)


def test_more_errors_outside_of_their_intervals_than_by_chance_are_noted():
    interval, out, unknown = np.array([[-1.0, 1.0]] * 3), np.array([2.0, 0.0, 2.0]), np.array([2.0, 0.0, np.nan])
    drives = [Prediction('a', 1.0, 1.0, error, interval[:, 1], interval, None) for error in (out, unknown, out * 0.1)]
    assert prediction_note([], drives) == ''  # 3 of 8: probability 0.04
    more = [*drives, drives[0]._replace(drive='b')]
    assert 'count on the observed errors' in prediction_note([], more)  # 5 of 11: 0.003
    assert prediction_note([Disturbance('b', 1.0, 2.0, True)], more) == ''
    assert prediction_note([], [drives[0]._replace(error=out + 2.0)]) == prediction_note([], []) == ''  # a single drive


def test_ends_of_squares_correct_the_robot(tmp_path, capsys):
    (tmp_path / 'ends.csv').write_text('cw,-0.269,-0.305\nccw,0.034,-0.033\n')
    robot, out = robot_file(tmp_path / 'nominal.yaml'), tmp_path / 'r.yaml'
    written = f'--json {tmp_path / "r.json"} --out {out}'
    calibrate.main(f'--umbmark --ends {tmp_path / "ends.csv"} --robot {robot} {written}'.split())
    assert 'E_d' in capsys.readouterr().out
    content = json.loads((tmp_path / 'r.json').read_text())
    settings = load_numbers(str(out), tmp_path, ROOT, {})[1]
    multiplier = content['diff_drive_controller']['wheel_separation_multiplier']
    assert multiplier == pytest.approx(content['e_b'], rel=1e-6)
    assert content['e_max_syst_after_m'] < 0.1 * content['e_max_syst_before_m']
    assert settings['config.wheel_separation'] == pytest.approx(content['wheel_separation_m'])
    assert settings['config.wheel_diameter']['left'] == pytest.approx(content['left_wheel_diameter_m'])


@pytest.mark.skipif(not REAL_DRIVES.exists(), reason='the drives of others are not part of the project')
def test_the_wheelchair_is_as_an_independent_fit_found_it():
    paths = [REAL_DRIVES / f'wheelchair_{number}.txt' for number in (1, 2)]
    options = {'csv': paths, 'time_unit': 'ms', 'length_unit': 'cm', 'ticks_per_revolution': 409600}
    options['columns'] = ('n_time', 'tick_L', 'tick_R')
    options['reference_columns'] = ('n_time', 'pose_x', 'pose_y', 'pose_theta')
    found = api.calibrate(**options)
    values = {name: each.value for name, each in found.values.items()}
    assert 1.0042 < values['radius_ratio'] < 1.0062 and 0.2807 < values['radius_per_separation'] < 0.2825
    assert -0.222 < values['reference_x_m'] < -0.207 and 0.09 < values['reference_delay_s'] < 0.13
