"""The parameter /trial of trial.launch: paths, rates and the robot, and bad arguments before anything starts."""

import math
from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.api import live_trials
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import from_xml_rpc
from diff_encoder_sim.cli.trial_spec import main as trial_spec
from diff_encoder_sim.cli.trial_spec import parse
from diff_encoder_sim.drives.trial_definition import LivePlan
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
PPR_ALLOWED = '0.001 to 1e9 [per revolution]'
FILES = {'list': '- ppr\n- 90\n', 'negative': 'wheel_diameter: -0.2\n', 'lines': 'encoder: {lines: 500}\n'}
FILES['no_route'] = 'name: t\nworld: hallway\ndrive: [{straight: 1.0}]\n'


def plan(*arguments):
    return live_trials.plan(parse(['--bag', 'none', '--test', 'SL', *map(str, arguments)]))


def file(folder, text, name='mine.yaml'):
    path = folder / name
    path.write_text(text)
    return path


def robot_file(folder, **overrides):
    settings = {key.replace('__', '.'): value for key, value in overrides.items()}
    return file(folder, yaml.safe_dump({'urdf': str(ALTO), 'set': settings}))


def test_a_users_own_test_is_found_by_its_path(tmp_path):
    start, drive = '{x: 1.0, y: 0.5, yaw: 1.5707963267948966}', '[{straight: 2.0}, {turns: 0.25}, {straight: -1.0}]'
    path = file(tmp_path, f'name: mine\nworld: hallway\nstart: {start}\ndrive: {drive}\n')
    assert plan('--test', path, '--nav', 'scripted').trial.test.goal() == pytest.approx((2.0, 2.5, -math.pi))


@pytest.mark.parametrize(
    ('world', 'start', 'where'),
    [
        ('hallway', '{x: -30.0, y: 0.5}', r'\(-30.00, 0.50\), outside'),
        ('hallway', '{x: 0.0, y: 2.98}', r'\(0.00, 2.98\), in a wall of'),
        ('ros_logo', '{x: 1.87}', r'\(1.87, 0.00\), in unknown space of'),  # within a pillar
    ],
)
def test_a_start_outside_free_space_is_refused_for_navigation(tmp_path, world, start, where):
    path = file(tmp_path, f'name: t\nworld: {world}\nstart: {start}\nroute: [{{goal: {{}}}}]\ndrive: [{{turns: 1}}]\n')
    with pytest.raises(ConfigError, match=f'test t: start: given {where} the map .*{world}.yaml'):
        plan('--test', path)
    assert plan('--test', path, '--nav', 'scripted').trial.nav == 'scripted'


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        ('--test=XX', ["test: given 'XX'; allowed: DLD, SL, SMT, UMBMARK"]),
        ('--ppr=0', ['ppr: given 0', PPR_ALLOWED]),
        ('--ppr={left: 40, right: -4}', ['ppr.right', '-4', PPR_ALLOWED]),
        ('--ppr=0100', ['ppr', '0100', 'YAML 1.1', '64']),
        ('--trial=-1', ['trial: given -1', '0 to']),
        ('--odom=foo', ["odom: given 'foo'", 'encoder', 'ideal']),
        ('--sim=foo', ["sim: given 'foo'; allowed: pybullet, gazebo"]),
        ('--bag=/proc/1/new.bag', ['bag', '/proc/1']),
        ('--bag={}/list.yaml', ['bag', 'list.yaml exists', 'new file']),
        ('--map={}/nowhere.yaml', ['map', 'nowhere.yaml', 'rasterise_world']),
        ('--robot={}/nobody.urdf', ['nobody.urdf', 'but there is no']),
        ('--encoder=amt102 --ppr=90', ['encoder: given amt102 with ppr 90; allowed: one of them']),
        ('--config={}/nowhere.yaml', ['nowhere.yaml: cannot be read']),
        ('--config={}/negative.yaml', ['negative.yaml', 'wheel_diameter', '-0.2', '0.001 to 100 [m]']),
        ('--config={}/lines.yaml --ppr=90', ['lines.yaml: encoder: given 500 lines x 4', 'with ppr 90']),
        ('--test=DLD --nav=scripted', ['DLD has no path']),
        ('--test={}/no_route.yaml', ['nav', 'embedded', 't has no route', 'scripted']),
    ],
)
def test_a_bad_argument_is_named_in_one_line(arguments, words, tmp_path):
    for name, text in FILES.items():
        file(tmp_path, text, f'{name}.yaml')
    split = [f'--{each}' for each in arguments.replace('{}/', f'{tmp_path}/').split('--')[1:]]
    with pytest.raises(SystemExit) as stopped:
        trial_spec(['--test', 'SL', '--bag', 'none', *(each.strip() for each in split)])
    text = stopped.value.code
    assert text.startswith('trial.launch: ') and '\n' not in text
    assert all(word in text for word in words), text


def test_arguments_and_files_are_read(tmp_path):
    trial = plan('--ppr', '{left: 40, right: 4096}', '--trial', '7', '--odom', 'ideal').trial
    assert (trial.ppr.left, trial.ppr.right, trial.number, trial.odom) == (40, 4096, 7, 'ideal')
    trial = plan('--config', file(tmp_path, 'ppr: 1024\nwheel_separation: 0.5\n')).trial
    assert (trial.ppr.left, trial.wheel_separation, trial.wheel_diameter.plain) == (1024, 0.5, 0.2)
    burger = plan('--test', 'SMT', '--robot', 'burger').trial
    assert (burger.wheel_diameter.plain, burger.wheel_separation, burger.ppr.left) == (0.066, 0.16, 4096)
    assert (burger.left_joint, burger.right_joint) == ('wheel_left_joint', 'wheel_right_joint')


def test_paths_are_relative_to_the_users_folder(tmp_path, monkeypatch):
    """roslaunch runs its commands in another one."""
    monkeypatch.setenv('PWD', str(tmp_path))
    assert plan('--bag', 'a/b.bag').bag == str(tmp_path / 'a' / 'b.bag')
    default = Path(plan('--ppr', '40', '--bag', '').bag)
    assert default.parent == tmp_path / 'bags' and default.name.startswith('SL_40ppr_trial0_')
    robot_file(tmp_path, config__wheel_diameter=0.21)
    assert plan('--test', 'SMT', '--robot', 'mine.yaml').trial.wheel_diameter.plain == 0.21


def test_the_printed_plan_passes_the_parameter_server(tmp_path, capsys):
    """YAML 1.1 reads 2.7e-08 as text unless it has a point; 32 bits do not fit XML-RPC."""
    noise = {'simulator__wheel_errors__slip_noise': 2e-8, 'config__counter_modulus': 2**32}
    arguments = ['--bag', 'none', '--test', 'SL', '--unchecked', 'true', '--robot', str(robot_file(tmp_path, **noise))]
    trial_spec(arguments)
    printed = yaml.safe_load(capsys.readouterr().out)
    assert printed['trial']['motion_noise'] == 2e-8 and printed['trial']['counter_modulus'] == '4294967296'
    assert LivePlan.from_mapping(from_xml_rpc(printed), '/trial') == live_trials.plan(parse(arguments))


@pytest.mark.parametrize(
    ('config', 'words', 'rate', 'delay_s', 'command_period'),
    [
        ('', '--nav scripted', 20.0, 0.0, 0.05),
        ('', '--nav embedded', 20.0, 0.0, 0.05),
        ('', '--nav upstream', 20.0, 0.0, 0.0),  # has no fixed period
        ('rate: 33.3', '--nav embedded --navigation-config {}', 33.3, 0.0, 0.1),
        ('rate: 33.3', '--nav scripted --navigation-config {}', 33.3, 0.0, 0.05),  # follows the true poses
        ('rate: 50', '--odom ideal', 20.0, 0.0, 0.05),
        ('rate: 1000', '--nav scripted', 100.0, 0.0, 0.05),  # of the simulator's joint states
        ('rate: 1000', '--nav scripted --sim gazebo', 1000.0, 0.0, 0.05),  # whose rate is in the URDF
        ('report: {latency: 0.03}', '--nav embedded', 20.0, 0.03, 0.05),
        ('report: {latency: 0.03, latency_spread: 0.01, jitter: 0.005}', '--nav embedded', 20.0, 0.045, 0.0),
        ('report: {reordered: 0.1}', '--nav embedded', 20.0, 0.075, 0.0),
        ('report: {lost: 0.1}', '--nav embedded', 20.0, 0.3, 0.0),  # six in a row are one in a million
        ('report: {latency: 0.03}', '--odom ideal', 20.0, 0.0, 0.05),
    ],
)
def test_a_trial_has_the_rates_and_delays_of_its_sources(
    tmp_path, monkeypatch, config, words, rate, delay_s, command_period
):
    monkeypatch.setattr(live_trials, 'parent_only_lists', lambda: True)  # as if every package were installed
    navigation = file(tmp_path, 'controller_frequency: 10\n', 'navigation.yaml')
    path = file(tmp_path, f'{config or "{}"}\n', 'config.yaml')
    made = plan('--test', 'SMT', '--config', path, *words.replace('{}', str(navigation)).split())
    assert (made.report_rate, made.command_period) == (rate, command_period)
    assert made.report_delay == pytest.approx(delay_s)


def test_a_rate_above_that_of_joint_states_is_printed(tmp_path, capsys):
    config = file(tmp_path, 'rate: 1000\n')
    for odom, lines in (('encoder', 1), ('ideal', 0)):
        plan('--nav', 'scripted', '--unchecked', 'true', '--odom', odom, '--config', config)
        assert capsys.readouterr().err.count('trial.launch: rate: 1000 Hz, but') == lines


def test_the_robot_must_fit_the_test(tmp_path):
    slow = robot_file(tmp_path, simulator__drive__max_linear_speed=0.1)
    assert plan('--robot', slow, '--nav', 'scripted').trial.test.limits.speed == 0.1
    with pytest.raises(ConfigError, match='^test DLD: not for this robot: .*; allowed: .*unchecked:=true'):
        plan('--test', 'DLD', '--robot', slow)
    assert plan('--test', 'DLD', '--robot', slow, '--unchecked', 'true').trial.test.name == 'DLD'


def test_the_robot_must_pass_its_self_check_except_in_gazebo(tmp_path, capsys, monkeypatch):
    weak = robot_file(tmp_path, simulator__drive__wheel_torque=0.01)
    with pytest.raises(ConfigError, match='mine.yaml: the robot fails its self-check: '):
        plan('--robot', weak)
    assert 'NOT OK' in capsys.readouterr().err
    monkeypatch.setattr(live_trials, 'require', lambda package: None)
    assert plan('--robot', weak, '--sim', 'gazebo').trial.test.name == 'SL'


def test_a_real_encoder_is_in_the_plan_and_overrides_the_robots_resolution(tmp_path, capsys):
    own = '--unchecked', 'true', '--robot', robot_file(tmp_path, config__encoder__lines=500)
    trial = plan(*own).trial
    assert (trial.encoder_label, trial.resolution[:17]) == ('2000', '500 lines x 4 = 2')
    assert 'trial.launch: encoder: 500 lines x 4 = 2000 counts' in capsys.readouterr().err
    trial = plan(*own, '--encoder', 'amt102').trial
    assert (trial.encoder_label, trial.encoder) == ('8192 amt102', 'amt102')
    assert trial.resolution == '2048 lines x 4 = 8192 counts per wheel turn'
    assert capsys.readouterr().err.count('trial.launch: amt102 (CUI Devices AMT102-V, at 2048 lines): 2048 lines') == 1
    assert plan(*own, '--ppr', '90').trial.encoder_label == '90'
