"""The parameter /trial: the rates that the live graph's nodes take from it, each from the file that sets it."""

import pytest

from diff_encoder_sim.api import live_trials as trial_spec
from diff_encoder_sim.cli.trial_spec import parse
from places import ROOT

CONFIG = ROOT / 'config'


@pytest.fixture
def plan(monkeypatch):
    monkeypatch.setattr(trial_spec, 'parent_only_lists', lambda: True)  # as if every package were installed
    return lambda *words: trial_spec.plan(parse(['--test', 'SMT', '--bag', 'none', *map(str, words)]))


@pytest.mark.parametrize(('nav', 'command_period'), [('scripted', 0.05), ('embedded', 0.05), ('upstream', 0.0)])
def test_by_default_all_have_20_hz_and_nobody_waits_for_upstreams_commands(plan, nav, command_period):
    made = plan('--nav', nav)
    assert (made.report_rate, made.command_period) == (20.0, command_period)


def test_each_rate_is_the_one_in_its_file(plan, tmp_path):
    encoder, navigation = tmp_path / 'config.yaml', tmp_path / 'navigation.yaml'
    encoder.write_text('rate: 33.3\n')
    navigation.write_text('controller_frequency: 10\n')
    files = ['--config', encoder, '--navigation-config', navigation]
    made = plan('--nav', 'embedded', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.1)
    made = plan('--nav', 'scripted', *files)
    assert (made.report_rate, made.command_period) == (33.3, 0.05)  # the script's commands answer the true poses


def test_ideal_odometry_comes_with_the_states_whatever_the_encoder(plan, tmp_path):
    (tmp_path / 'config.yaml').write_text('rate: 50\n')
    assert plan('--odom', 'ideal', '--config', tmp_path / 'config.yaml').report_rate == 20.0


@pytest.mark.parametrize(('sim', 'rate'), [('pybullet', 100.0), ('gazebo', 1000.0)])
def test_reports_come_no_faster_than_the_simulators_joint_states(plan, tmp_path, sim, rate):
    """Gazebo's rate is in the URDF."""
    (tmp_path / 'config.yaml').write_text('rate: 1000\nreport: {lost: 0.1}\n')
    made = plan('--nav', 'scripted', '--sim', sim, '--config', tmp_path / 'config.yaml')
    assert (made.report_rate, made.report_delay) == (rate, pytest.approx(6 / rate))


def test_the_trial_says_so(plan, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(trial_spec, 'parent_only_lists', lambda: False)
    (tmp_path / 'config.yaml').write_text('rate: 1000\n')
    for odom, lines in (('encoder', 1), ('ideal', 0)):
        plan('--nav', 'scripted', '--unchecked', 'true', '--odom', odom, '--config', tmp_path / 'config.yaml')
        said = 'trial.launch: rate: 1000 Hz of reports, but joint states come at 100 Hz: so do reports\n'
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
def test_reports_that_come_late_or_never_are_not_waited_for_in_vain(plan, tmp_path, report, delay_s, command_period):
    (tmp_path / 'config.yaml').write_text(f'report: {report}\n')
    made = plan('--nav', 'embedded', '--config', tmp_path / 'config.yaml')
    assert (made.report_delay, made.command_period) == (pytest.approx(delay_s), command_period)
    assert plan('--odom', 'ideal', '--config', tmp_path / 'config.yaml').report_delay == 0.0
