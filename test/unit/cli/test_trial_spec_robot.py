"""The robot of trial.launch: its wheels in the plan, and what it cannot do, before anything starts."""

import pytest
import yaml

from diff_encoder_sim.api import live_trials as trial_spec
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.text_values import from_xml_rpc
from diff_encoder_sim.cli.trial_spec import main as trial_spec_main
from diff_encoder_sim.cli.trial_spec import parse
from diff_encoder_sim.drives.trial_definition import LivePlan
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'


def plan(*arguments):
    return trial_spec.plan(parse(['--bag', 'none', *arguments]))


def robot_file(folder, **overrides):
    path = folder / 'mine.yaml'
    settings = {key.replace('__', '.'): value for key, value in overrides.items()}
    path.write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': settings}))
    return str(path)


def test_the_bag_will_hold_the_robots_wheels_joints_and_encoder():
    burger = plan('--test', 'SMT', '--robot', 'burger').trial
    assert (burger.wheel_diameter, burger.wheel_separation, burger.ppr.left) == (0.066, 0.16, 4096)
    assert (burger.left_joint, burger.right_joint) == ('wheel_left_joint', 'wheel_right_joint')
    assert plan('--test', 'SMT', '--robot', 'burger', '--ppr', '90').trial.ppr.left == 90


def test_a_counter_of_32_bits_passes_the_parameter_server(capsys):
    trial_spec_main(['--bag', 'none', '--test', 'SMT', '--robot', 'burger'])
    printed = yaml.safe_load(capsys.readouterr().out)
    assert printed['trial']['counter_modulus'] == '4294967296'
    assert LivePlan.from_mapping(from_xml_rpc(printed), '').trial.counter_modulus == 2**32


def test_a_test_is_driven_no_faster_than_the_robot(tmp_path):
    slow = robot_file(tmp_path, simulator__drive__max_linear_speed=0.2)
    assert plan('--test', 'SL', '--robot', slow, '--nav', 'scripted').trial.test.limits.speed == 0.2


def test_a_robot_that_cannot_do_the_test_is_refused_in_one_line(tmp_path):
    slow = robot_file(tmp_path, simulator__drive__max_linear_speed=0.1)
    with pytest.raises(ConfigError, match='^test DLD: not for this robot: .*; allowed: .*unchecked:=true'):
        plan('--test', 'DLD', '--robot', slow)
    assert plan('--test', 'DLD', '--robot', slow, '--unchecked', 'true').trial.test.name == 'DLD'


def test_a_robot_that_fails_its_self_check_is_refused_with_the_table(tmp_path, capsys):
    weak = robot_file(tmp_path, simulator__drive__wheel_torque=0.01)
    with pytest.raises(ConfigError, match='mine.yaml: the robot fails its self-check: '):
        plan('--test', 'SL', '--robot', weak)
    assert 'NOT OK' in capsys.readouterr().err


def test_gazebo_has_physics_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(trial_spec, 'require', lambda package: None)
    weak = robot_file(tmp_path, simulator__drive__wheel_torque=0.01)
    assert plan('--test', 'SL', '--robot', weak, '--sim', 'gazebo').trial.test.name == 'SL'


def test_paths_are_relative_to_the_users_folder(tmp_path, monkeypatch):
    """roslaunch runs its commands elsewhere."""
    robot_file(tmp_path, config__wheel_diameter=0.21)
    monkeypatch.setenv('PWD', str(tmp_path))
    assert plan('--test', 'SMT', '--robot', 'mine.yaml').trial.wheel_diameter == 0.21


def test_a_real_encoder_is_in_the_plan_and_named_once(tmp_path, capsys):
    trial = plan('--test', 'SL', '--encoder', 'amt102', '--unchecked', 'true').trial
    assert (trial.encoder_label, trial.encoder) == ('8192 amt102', 'amt102')
    assert trial.resolution == '2048 lines x 4 = 8192 counts per wheel revolution'
    said = capsys.readouterr().err
    assert said.count('trial.launch: amt102 (CUI Devices AMT102-V, at 2048 PPR): 2048 lines x 4 = 8192 counts') == 1


def test_a_robots_own_resolution_is_in_the_plan_and_gives_way_to_an_argument(tmp_path, capsys):
    own = ('--test', 'SL', '--unchecked', 'true', '--robot', robot_file(tmp_path, config__encoder__lines=500))
    trial = plan(*own).trial
    assert (trial.encoder_label, trial.resolution[:17]) == ('2000', '500 lines x 4 = 2')
    assert 'trial.launch: encoder: 500 lines x 4 = 2000 counts per wheel revolution, 3183.1' in capsys.readouterr().err
    assert [plan(*own, *other).trial.encoder_label for other in (['--ppr', '90'], ['--encoder', 'xl430'])] == [
        '90',
        '4096 xl430',
    ]


def test_two_resolutions_are_one_line(tmp_path):
    with pytest.raises(ConfigError, match='^encoder: given amt102 beside ppr 90; allowed: one of them'):
        plan('--test', 'SL', '--encoder', 'amt102', '--ppr', '90')
    config = yaml.safe_load((ROOT / 'config' / 'config.yaml').read_text())
    config['encoder']['lines'] = 500
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump(config))
    with pytest.raises(ConfigError, match='mine.yaml: encoder: given 500 lines x 4 = .* beside ppr 90; allowed: one'):
        plan('--test', 'SL', '--config', str(tmp_path / 'mine.yaml'), '--ppr', '90')
