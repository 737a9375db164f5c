"""The parameter /trial of trial.launch: paths, rates and the robot, and mistakes before anything starts."""

import math
from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.api import live_trials as trial_spec
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import from_xml_rpc
from diff_encoder_sim.cli.trial_spec import main as trial_spec_main
from diff_encoder_sim.cli.trial_spec import parse
from diff_encoder_sim.drives.trial_definition import LivePlan
from places import ROOT


def plan(*arguments):
    return trial_spec.plan(parse(['--bag', 'none', '--test', 'SL', *arguments]))


def test_a_test_without_a_drive_is_refused_where_it_is_to_be_scripted():
    with pytest.raises(ConfigError, match='DLD has no drive'):
        plan('--test', 'DLD', '--nav', 'scripted')
    assert plan('--test', 'DLD', '--nav', 'embedded').trial.nav == 'embedded'


def test_a_users_own_test_is_found_by_its_path(tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text(
        'name: mine\nworld: hallway\nstart: {x: 1.0, y: 0.5, yaw: 1.5707963267948966}\n'
        'drive: [{straight: 2.0}, {turns: 0.25}, {straight: -1.0}]\n'
    )
    goal = plan('--test', str(path), '--nav', 'scripted').trial.test.goal()
    assert goal == pytest.approx((2.0, 2.5, -math.pi))


@pytest.mark.parametrize(
    ('world', 'start', 'where'),
    [
        ('hallway', '{x: -30.0, y: 0.5}', r'\(-30.00, 0.50\), outside'),
        ('hallway', '{x: 0.0, y: 2.98}', r'\(0.00, 2.98\), in a wall of'),
        # within a pillar
        ('ros_logo', '{x: 1.87}', r'\(1.87, 0.00\), in unknown space of'),
    ],
)
def test_a_start_that_the_map_forbids_is_named_before_anything_starts(tmp_path, world, start, where):
    """Nothing would find the robot there: it would stand until the test's time limit."""
    path = tmp_path / 'away.yaml'
    path.write_text(f'name: away\nworld: {world}\nstart: {start}\nroute: [{{goal: {{}}}}]\ndrive: [{{turns: 1}}]\n')
    with pytest.raises(ConfigError, match=f'test away: start: given {where} the map .*{world}.yaml'):
        plan('--test', str(path))
    assert plan('--test', str(path), '--nav', 'scripted').trial.nav == 'scripted'


@pytest.mark.parametrize(
    ('arguments', 'complaint'),
    [
        (['--test', 'XX'], "test: given 'XX'; allowed: DLD, SL, SMT"),
        (['--ppr', '0'], 'ppr: given 0; allowed'),
        (['--ppr', 'many'], "ppr: given 'many'"),
        (['--ppr', '.nan'], 'ppr: given nan'),
        (['--ppr', '{left: 40}'], 'ppr.right: missing'),
        (['--ppr', '[40'], "ppr: given '\\[40'"),
        (['--trial', '-1'], 'trial: given -1'),
        (['--trial', '1.5'], 'trial: given 1.5'),
        (['--odom', 'perfect'], "odom: given 'perfect'"),
        (['--sim', 'webots'], "sim: given 'webots'; allowed: pybullet, gazebo"),
        (['--config', '/no.yaml'], '/no.yaml: cannot be read'),
    ],
)
def test_bad_arguments_of_the_launch_file_are_named(arguments, complaint):
    with pytest.raises(ConfigError, match='^' + complaint):
        plan(*arguments)


def test_arguments_are_read_as_roslaunch_reads_them():
    trial = plan('--ppr', '{left: 40, right: 4096}', '--trial', '7', '--odom', 'ideal').trial
    assert (trial.ppr.left, trial.ppr.right, trial.number, trial.odom) == (40, 4096, 7, 'ideal')


def test_without_an_argument_the_ppr_is_the_configurations(tmp_path):
    config = tmp_path / 'c.yaml'
    config.write_text('ppr: 1024\nwheel_separation: 0.5\n')
    trial = plan('--config', str(config)).trial
    assert (trial.ppr.left, trial.wheel_separation, trial.wheel_diameter) == (1024, 0.5, 0.2)


def test_a_misspelt_key_of_the_configuration_is_found_before_anything_starts(tmp_path):
    config = tmp_path / 'c.yaml'
    config.write_text('wheel_seperation: 0.5\n')
    with pytest.raises(ConfigError, match="wheel_seperation: unknown key; did you mean 'wheel_sep"):
        plan('--config', str(config))


def test_bags_are_never_overwritten_and_relative_paths_are_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv('PWD', str(tmp_path))
    assert plan('--bag', 'a/b.bag').bag == str(tmp_path / 'a' / 'b.bag')
    default = Path(plan('--ppr', '40', '--bag', '').bag)
    assert default.parent == tmp_path / 'bags' and default.name.startswith('SL_40ppr_trial0_')
    (tmp_path / 'there.bag').write_text('precious')
    with pytest.raises(ConfigError, match='there.bag exists'):
        plan('--bag', 'there.bag')


def test_the_tool_prints_one_line_and_exits_with_1(capsys):
    with pytest.raises(SystemExit) as caught:
        trial_spec_main(['--test', 'XX'])
    assert caught.value.code == "trial.launch: test: given 'XX'; allowed: DLD, SL, SMT, or a .yaml file"


def test_what_it_prints_is_read_by_roslaunch_as_it_was(tmp_path, capsys):
    """Of 2.7e-08 YAML 1.1 makes a text, unless it has a point."""
    slipping = (ROOT / 'config' / 'robots' / 'alto.yaml').read_text()
    slipping = slipping.replace('../../urdf/', f'{ROOT}/urdf/')
    (tmp_path / 'slipping.yaml').write_text(f'{slipping}  simulator.wheel_errors.slip_noise: 2.0e-8\n')
    arguments = ['--bag', 'none', '--test', 'SL', '--unchecked', 'true', '--robot', str(tmp_path / 'slipping.yaml')]
    trial_spec_main(arguments)
    printed = yaml.safe_load(capsys.readouterr().out)
    assert printed['trial']['motion_noise'] == 2e-8
    assert LivePlan.from_mapping(printed, '/trial') == trial_spec.plan(parse(arguments))


@pytest.fixture
def rated(monkeypatch):
    monkeypatch.setattr(trial_spec, 'parent_only_lists', lambda: True)  # as if every package were installed
    return lambda *words: trial_spec.plan(parse(['--test', 'SMT', '--bag', 'none', *map(str, words)]))


@pytest.mark.parametrize(('nav', 'command_period'), [('scripted', 0.05), ('embedded', 0.05), ('upstream', 0.0)])
def test_by_default_all_have_20_hz_and_nobody_waits_for_upstreams_commands(rated, nav, command_period):
    made = rated('--nav', nav)
    assert (made.report_rate, made.command_period) == (20.0, command_period)


def test_each_rate_is_the_one_in_its_file(rated, tmp_path):
    encoder, navigation = tmp_path / 'config.yaml', tmp_path / 'navigation.yaml'
    encoder.write_text('rate: 33.3\n')
    navigation.write_text('controller_frequency: 10\n')
    files = ['--config', encoder, '--navigation-config', navigation]
    made = rated('--nav', 'embedded', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.1)
    made = rated('--nav', 'scripted', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.05)  # the script's commands answer the true poses


def test_ideal_odometry_comes_with_the_states_whatever_the_encoder(rated, tmp_path):
    (tmp_path / 'config.yaml').write_text('rate: 50\n')
    assert rated('--odom', 'ideal', '--config', tmp_path / 'config.yaml').report_rate == 20.0


@pytest.mark.parametrize(('sim', 'rate'), [('pybullet', 100.0), ('gazebo', 1000.0)])
def test_reports_come_no_faster_than_the_simulators_joint_states(rated, tmp_path, sim, rate):
    """Gazebo's rate is in the URDF."""
    (tmp_path / 'config.yaml').write_text('rate: 1000\nreport: {lost: 0.1}\n')
    made = rated('--nav', 'scripted', '--sim', sim, '--config', tmp_path / 'config.yaml')
    assert (made.report_rate, made.report_delay) == (rate, pytest.approx(6 / rate))


def test_the_trial_says_so(rated, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(trial_spec, 'parent_only_lists', lambda: False)
    (tmp_path / 'config.yaml').write_text('rate: 1000\n')
    for odom, lines in (('encoder', 1), ('ideal', 0)):
        rated('--nav', 'scripted', '--unchecked', 'true', '--odom', odom, '--config', tmp_path / 'config.yaml')
        said = 'trial.launch: rate: 1000 Hz, but reports are limited to the 100 Hz of joint states\n'
        assert capsys.readouterr().err.count(said) == lines


@pytest.mark.parametrize(
    ('report', 'delay_s', 'command_period'),
    [
        ('{}', 0.0, 0.05),
        ('{latency: 0.03}', 0.03, 0.05),
        ('{latency: 0.03, latency_spread: 0.01, jitter: 0.005}', 0.045, 0.0),
        ('{reordered: 0.1}', 0.075, 0.0),
        ('{lost: 0.1}', 0.3, 0.0),  # six in a row are one in a million
        ('{repeated: 0.1}', 0.0, 0.05),
    ],
)
def test_reports_that_come_late_or_never_are_not_waited_for_in_vain(rated, tmp_path, report, delay_s, command_period):
    (tmp_path / 'config.yaml').write_text(f'report: {report}\n')
    made = rated('--nav', 'embedded', '--config', tmp_path / 'config.yaml')
    assert (made.report_delay, made.command_period) == (pytest.approx(delay_s), command_period)
    assert rated('--odom', 'ideal', '--config', tmp_path / 'config.yaml').report_delay == 0.0


ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'


def robot_plan(*arguments):
    return trial_spec.plan(parse(['--bag', 'none', *arguments]))


def robot_file(folder, **overrides):
    path = folder / 'mine.yaml'
    settings = {key.replace('__', '.'): value for key, value in overrides.items()}
    path.write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': settings}))
    return str(path)


def test_the_bag_will_hold_the_robots_wheels_joints_and_encoder():
    burger = robot_plan('--test', 'SMT', '--robot', 'burger').trial
    assert (burger.wheel_diameter, burger.wheel_separation, burger.ppr.left) == (0.066, 0.16, 4096)
    assert (burger.left_joint, burger.right_joint) == ('wheel_left_joint', 'wheel_right_joint')
    assert robot_plan('--test', 'SMT', '--robot', 'burger', '--ppr', '90').trial.ppr.left == 90


def test_a_counter_of_32_bits_passes_the_parameter_server(capsys):
    trial_spec_main(['--bag', 'none', '--test', 'SMT', '--robot', 'burger'])
    printed = yaml.safe_load(capsys.readouterr().out)
    assert printed['trial']['counter_modulus'] == '4294967296'
    assert LivePlan.from_mapping(from_xml_rpc(printed), '').trial.counter_modulus == 2**32


def test_a_test_is_driven_no_faster_than_the_robot(tmp_path):
    slow = robot_file(tmp_path, simulator__drive__max_linear_speed=0.2)
    assert robot_plan('--test', 'SL', '--robot', slow, '--nav', 'scripted').trial.test.limits.speed == 0.2


def test_a_robot_that_cannot_do_the_test_is_refused_in_one_line(tmp_path):
    slow = robot_file(tmp_path, simulator__drive__max_linear_speed=0.1)
    with pytest.raises(ConfigError, match='^test DLD: not for this robot: .*; allowed: .*unchecked:=true'):
        robot_plan('--test', 'DLD', '--robot', slow)
    assert robot_plan('--test', 'DLD', '--robot', slow, '--unchecked', 'true').trial.test.name == 'DLD'


def test_a_robot_that_fails_its_self_check_is_refused_with_the_table(tmp_path, capsys):
    weak = robot_file(tmp_path, simulator__drive__wheel_torque=0.01)
    with pytest.raises(ConfigError, match='mine.yaml: the robot fails its self-check: '):
        robot_plan('--test', 'SL', '--robot', weak)
    assert 'NOT OK' in capsys.readouterr().err


def test_gazebo_has_physics_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(trial_spec, 'require', lambda package: None)
    weak = robot_file(tmp_path, simulator__drive__wheel_torque=0.01)
    assert robot_plan('--test', 'SL', '--robot', weak, '--sim', 'gazebo').trial.test.name == 'SL'


def test_paths_are_relative_to_the_users_folder(tmp_path, monkeypatch):
    """roslaunch runs its commands elsewhere."""
    robot_file(tmp_path, config__wheel_diameter=0.21)
    monkeypatch.setenv('PWD', str(tmp_path))
    assert robot_plan('--test', 'SMT', '--robot', 'mine.yaml').trial.wheel_diameter == 0.21


def test_a_real_encoder_is_in_the_plan_and_named_once(tmp_path, capsys):
    trial = robot_plan('--test', 'SL', '--encoder', 'amt102', '--unchecked', 'true').trial
    assert (trial.encoder_label, trial.encoder) == ('8192 amt102', 'amt102')
    assert trial.resolution == '2048 lines x 4 = 8192 counts per wheel revolution'
    said = capsys.readouterr().err
    assert said.count('trial.launch: amt102 (CUI Devices AMT102-V, at 2048 PPR): 2048 lines x 4 = 8192 counts') == 1


def test_a_robots_own_resolution_is_in_the_plan_and_gives_way_to_an_argument(tmp_path, capsys):
    own = ('--test', 'SL', '--unchecked', 'true', '--robot', robot_file(tmp_path, config__encoder__lines=500))
    trial = robot_plan(*own).trial
    assert (trial.encoder_label, trial.resolution[:17]) == ('2000', '500 lines x 4 = 2')
    assert 'trial.launch: encoder: 500 lines x 4 = 2000 counts per wheel revolution, 3183.1' in capsys.readouterr().err
    assert [robot_plan(*own, *other).trial.encoder_label for other in (['--ppr', '90'], ['--encoder', 'xl430'])] == [
        '90',
        '4096 xl430',
    ]


def test_two_resolutions_are_one_line(tmp_path):
    with pytest.raises(ConfigError, match='^encoder: given amt102 with ppr 90; allowed: one of them'):
        robot_plan('--test', 'SL', '--encoder', 'amt102', '--ppr', '90')
    config = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    config['encoder']['lines'] = 500
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump(config))
    with pytest.raises(ConfigError, match='mine.yaml: encoder: given 500 lines x 4 = .* with ppr 90; allowed: one'):
        robot_plan('--test', 'SL', '--config', str(tmp_path / 'mine.yaml'), '--ppr', '90')
