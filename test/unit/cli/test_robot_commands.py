"""check_robot and robot_settings: what is found, whether it drives, the robot file, and settings of nodes."""

import re

import pytest
import yaml

from diff_encoder_sim.cli.check_robot import main as check
from diff_encoder_sim.cli.robot_settings import main
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.simulation.slip import CONTACT_CURVE_NOISE
from diff_encoder_sim.trials.robot_params import load_robot
from places import ROOT
from trial_bags import trial, write_bag

ALTO, KOBUKI = (ROOT / 'urdf' / f'{name}.urdf.xacro' for name in ('alto', 'kobuki'))


def test_a_robot_is_checked_and_the_written_file_means_the_same_robot(tmp_path, capsys):
    path = tmp_path / 'robots' / 'mine.yaml'
    check([str(KOBUKI), '--write', str(path)])
    out = capsys.readouterr().out
    assert 'wheel diameter [m]' in out and 'libgazebo_ros_diff_drive.so' in out
    assert 'straight, forward' in out and 'NOT OK' not in out
    assert 'kobuki: all checks are ok.' in out and f'Written: {path}' in out
    written, found = (load_robot(str(each), tmp_path, ROOT, {}) for each in (path, KOBUKI))
    assert written.settings == found.settings
    assert written.description.left == found.description.left and written.description.right == found.description.right
    assert written.description.footprint == found.description.footprint
    text = path.read_text()
    # AMCL takes less of a scan than the scanner gives.
    assert re.search(r'amcl.laser_max_range: 3.5 +# \[m\]\n', text)
    assert '# ppr: 90 ' in text and '# [m] libgazebo_ros_diff_drive.so' in text
    assert not any(line != line.rstrip() for line in text.splitlines())
    with pytest.raises(SystemExit, match='--write: .*mine.yaml exists; allowed: the path of a new file'):
        check([str(KOBUKI), '--write', str(path)])
    assert path.read_text() == text


def test_a_robot_file_keeps_what_its_user_knows(tmp_path):
    check(['kobuki', '--write', str(tmp_path / 'copy.yaml')])
    content = yaml.safe_load((tmp_path / 'copy.yaml').read_text())
    assert content['ppr'] == pytest.approx(2578.333, abs=1e-3)
    assert content['set']['config.counter_modulus'] == 65536


def test_a_robot_that_fails_ends_with_status_1_and_what_to_do(tmp_path, capsys):
    settings = {'simulator.drive.wheel_torque': 0.001}
    weak = yaml_file(tmp_path, 'weak.yaml', {'urdf': str(KOBUKI), 'set': settings})
    with pytest.raises(SystemExit, match='weak.yaml: the robot fails its self-check: '):
        check([str(weak)])
    out = capsys.readouterr().out
    assert 'NOT OK' in out and 'a higher simulator.drive.wheel_torque' in out


def test_a_robot_without_a_laser_gets_one_from_its_robot_file(tmp_path, capsys):
    blind, path = tmp_path / 'blind.urdf', tmp_path / 'blind.yaml'
    urdf = expansion(RobotSource(KOBUKI)).urdf.replace('"laser"', '"box"')
    blind.write_text(re.sub(r'<sensor.*?</sensor>', '', urdf, flags=re.DOTALL))
    check([str(blind), '--write', str(path)])
    out = capsys.readouterr().out
    assert 'straight, forward' in out and 'all checks are ok' in out
    line = re.search(r'a robot file \(YAML\): (\{.*\})', out)[1]
    assert yaml.safe_load(line)['laser']['parent'] == 'base_footprint'
    text = path.read_text()
    assert '# laser: {parent: base_footprint, xyz: [0.0, 0.0, 0.' in text
    path.write_text(text.replace('# laser: ', 'laser: '))
    check([str(path)])
    assert 'all checks are ok' in capsys.readouterr().out


@pytest.fixture(name='settings')
def fixture_settings(capsys):
    def settings(*arguments):
        main([str(argument) for argument in arguments])
        return yaml.safe_load(capsys.readouterr().out)

    return settings


def yaml_file(folder, name, content):
    path = folder / name
    path.write_text(yaml.safe_dump(content))
    return path


def robot_file(folder, **overrides):
    settings = {key.replace('__', '.'): value for key, value in overrides.items()}
    return yaml_file(folder, 'mine.yaml', {'urdf': str(ALTO), 'ppr': 360, 'set': settings})


def config_with(folder, **changes):
    """A copy of config/config.yaml with other values."""
    usual = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    return yaml_file(folder, 'my_config.yaml', {**usual, **changes})


def test_a_robot_by_name_has_its_own_wheels_frames_and_model(settings):
    burger = settings('burger')
    config, navigation = burger['config'], burger['navigation']
    assert config['left_joint'] == burger['simulator']['left_joint'] == 'wheel_left_joint'
    assert (config['wheel_diameter'], config['ppr']) == (0.066, 4096)
    frames = [burger['amcl']['base_frame_id'], burger['slam']['base_frame'], burger['global_pose']['base_frame']]
    assert frames == 3 * [config['base_frame']]
    assert burger['world_pose']['model'] == burger['ideal_odom']['model'] == 'burger'
    assert navigation['local_costmap']['footprint'] == navigation['global_costmap']['footprint']


def test_a_launch_argument_goes_before_a_robot_file_and_that_before_its_urdf(settings, tmp_path):
    mine = robot_file(tmp_path, simulator__lidar__noise=0.02, config__wheel_diameter=0.21)
    arguments = ['config.ppr:=40', 'simulator.lidar.noise:=0.07', 'config.left_joint:=']
    found = settings(mine, *arguments, '--config', config_with(tmp_path, ppr=1024))
    assert found['config']['ppr'] == 40 and found['simulator']['lidar']['noise'] == 0.07
    assert found['config']['left_joint'] == 'left_wheel_joint'
    found = settings(mine, '--robot-args', 'lidar_noise:=0.25')
    assert (found['config']['wheel_diameter'], found['config']['wheel_separation']) == (0.21, 0.4)
    assert found['simulator']['lidar']['noise'] == 0.02
    assert settings(ALTO, '--robot-args', 'lidar_noise:=0.25')['simulator']['lidar']['noise'] == 0.25


def test_what_a_users_yaml_file_changes_is_kept_and_said(tmp_path, capsys):
    """And what it only repeats from the package's file is the robot's: a whole copy makes nothing ALTO's."""
    main(['burger', '--config', str(config_with(tmp_path, wheel_diameter=0.21, ppr={'left': 40, 'right': 90}))])
    out, err = capsys.readouterr()
    burger = yaml.safe_load(out)['config']
    assert 'wheel_diameter' not in burger and 'ppr' not in burger  # the node's own, from the YAML file
    assert burger['left_joint'] == 'wheel_left_joint' and burger['wheel_separation'] == 0.16
    assert 'config.ppr: using ' in err and 'my_config.yaml, not 4096.0 of ' in err


def test_a_users_file_without_costmaps_gets_whole_ones(settings, tmp_path):
    path = yaml_file(tmp_path, 'navigation.yaml', {'controller_frequency': 10})
    local = settings('burger', '--navigation-config', path)['navigation']['local_costmap']
    assert local['rolling_window'] is True and local['robot_base_frame'] != 'base_link'


@pytest.mark.parametrize(
    ('command', 'arguments', 'expected'),
    [
        (check, ['nobody'], "given 'nobody', but there is no"),
        (check, [str(KOBUKI), '--robot-arg', 'size'], "--robot-arg: given 'size'; allowed: name:=value"),
        (main, ['alto', 'ppr'], "given 'ppr'; allowed: FILE.KEY:=VALUE"),
        (main, ['alto', '--imu', 'bno05', '--sim=pybullet'], "imu: given 'bno05'; allowed: bmi088, bno055, mpu6050"),
        (main, ['alto', '--imu', 'bno055', '--sim=gazebo'], 'imu: given bno055 with sim gazebo; allowed: with py'),
        (main, ['alto', '--robot-args', 'speed'], "robot_args: given 'speed'; allowed: name:=value"),
        (main, ['alto', '--config', '/nowhere.yaml'], '/nowhere.yaml: cannot be read'),
        (main, {'config__wheel_diameter': -1.0}, 'wheel_diameter: given -1.0'),
        (main, {'config__wheel_diametre': 0.2}, "unknown key; did you mean 'config.wheel_diameter'"),
    ],
)
def test_mistakes_are_one_line(tmp_path, command, arguments, expected):
    """Those of a robot file are named with it."""
    file = robot_file(tmp_path, **arguments) if isinstance(arguments, dict) else ''
    with pytest.raises(SystemExit) as ended:
        command([str(file)] if file else arguments)
    text = str(ended.value.code)
    assert expected in text and '\n' not in text and str(file) in text


def test_the_seed_of_the_encoders_errors_is_the_given_one_or_the_number_of_the_bags_trial(settings, tmp_path):
    write_bag(tmp_path / 'a.bag', trial(number=7))
    write_bag(tmp_path / 'no_trial.bag', None)

    def seed(*arguments):
        return settings('alto', *arguments)['config'].get('seed')

    bag, mine = f'--bag={tmp_path / "a.bag"}', config_with(tmp_path, seed=5)
    assert (seed('config.seed:=', bag), seed('config.seed:=3', bag), seed(bag, f'--config={mine}')) == (7, 3, None)
    assert seed('config.seed:=') is None and seed('config.seed:=9000000000') == '9000000000'  # XML-RPC has 32 bits
    for other in ('no_trial.bag', 'not_there.bag'):
        assert seed(f'--bag={tmp_path / other}') is None


def test_a_real_encoder_sets_all_that_the_parameter_server_can_hold(settings):
    config = settings('alto', '--encoder', 'xl430')['config']
    assert config['encoder']['bits'] == 12 and config['encoder']['faults']['missed'] == 0.0
    assert config['counter_modulus'] == '4294967296' and config['ppr'] == {'left': 4096.0, 'right': 4096.0}
    assert None not in config['encoder'].values()


def test_an_imu_is_chosen_by_name_for_the_simulator_that_is_ours(settings):
    for name in ('', 'none'):
        assert settings('alto', f'--imu={name}', '--sim=gazebo') == settings('alto', '--sim=gazebo')
    imu = settings('alto', '--imu=bno055', '--sim=pybullet')['simulator']['imu']
    assert (imu['rate'], imu['gyroscope']['noise_density'], imu['frame']) == (100.0, 2.443e-4, 'imu_link')
    slow = settings('alto', 'simulator.imu.rate:=50.0', '--imu=bno055', '--sim=pybullet')['simulator']['imu']
    assert slow == {**imu, 'rate': 50.0}


def test_the_covariance_is_that_of_simulated_wheels_of_a_real_robots_slip_or_of_the_users_file(settings, tmp_path):
    path = robot_file(tmp_path, simulator__wheel_errors__slip_noise=2.7e-8)
    config = settings(path, '--sim', 'pybullet')['config']
    assert (config['motion_noise'], config['curve_noise']) == (2.7e-8, CONTACT_CURVE_NOISE)
    assert settings('alto', '--sim', 'pybullet')['config']['motion_noise'] == 0.0
    config = settings(path)['config']
    assert (config['motion_noise'], config['curve_noise'], config['distance_std']) == (2.7e-8, 0.0, 0.0)
    mine = config_with(tmp_path, motion_noise=3e-7)
    assert settings(path, '--config', mine)['config']['motion_noise'] == 3e-7


def test_a_default_that_hides_the_encoder_is_warned_of_once(capsys, tmp_path):
    slips = str(robot_file(tmp_path, simulator__wheel_errors__slip_noise=2.7e-8))
    for *arguments, expected in (
        ('burger', 1),
        ('alto', 'config.ppr:=40', 0),
        ('burger', '--sim', 'pybullet', 0),
        ('burger', 'config.motion_noise:=1.0e-6', 0),
        (slips, 0),
    ):
        main(arguments)
        assert capsys.readouterr().err.count("/odom's covariance hides the encoder") == expected
