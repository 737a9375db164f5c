"""The arguments of trial.launch: what they come to, and how a bad one is named before anything starts."""

import math
from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.api import live_trials as trial_spec
from diff_encoder_sim.base.errors import ConfigError
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


@pytest.mark.parametrize(('argument', 'name'), [('bag', 'n' * 250 + '.bag'), ('save_map', 'n' * 240)])
def test_a_name_that_is_too_long_for_an_unfinished_file_is_refused_before_the_trial(tmp_path, argument, name):
    words = ['--test', 'SL', '--nav', 'scripted', '--slam', 'embedded', '--bag', 'none']
    with pytest.raises(ConfigError, match=f'^{argument}: given n+...n+[.bag]*; allowed: a name of at most 200 bytes'):
        trial_spec.plan(parse([*words, f'--{argument.replace("_", "-")}', str(tmp_path / name)]))


def test_the_tool_prints_one_line_and_exits_with_1(capsys):
    with pytest.raises(SystemExit) as caught:
        trial_spec_main(['--test', 'XX'])
    assert caught.value.code == "trial.launch: test: given 'XX'; allowed: DLD, SL, SMT, or a .yaml file"


# ---- rates that the nodes of the graph must agree on


@pytest.fixture
def as_if_installed(monkeypatch):
    monkeypatch.setattr(trial_spec, 'parent_only_lists', lambda: True)


@pytest.mark.parametrize(('nav', 'command_period'), [('scripted', 0.05), ('embedded', 0.05), ('upstream', 0.0)])
def test_by_default_all_have_20_hz_and_nobody_waits_for_upstreams_commands(as_if_installed, nav, command_period):
    made = plan('--nav', nav)
    assert (made.report_rate, made.command_period) == (20.0, command_period)


def test_each_rate_is_the_one_in_its_file(tmp_path):
    encoder, navigation = tmp_path / 'config.yaml', tmp_path / 'navigation.yaml'
    encoder.write_text('rate: 33.3\n')
    navigation.write_text('controller_frequency: 10\n')
    files = ['--config', str(encoder), '--navigation-config', str(navigation)]
    made = plan('--nav', 'embedded', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.1)
    made = plan('--nav', 'scripted', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.05)  # scripted commands answer the true poses


def test_ideal_odometry_comes_with_the_states_whatever_the_encoder(tmp_path):
    (tmp_path / 'config.yaml').write_text('rate: 50\n')
    assert plan('--odom', 'ideal', '--config', str(tmp_path / 'config.yaml')).report_rate == 20.0


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
