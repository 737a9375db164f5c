"""What tools that run trials check and print before and after them."""

import argparse
import json
import os
import signal
from types import SimpleNamespace

import pytest

from campaign_files import small_campaign
from diff_encoder_sim.api.campaigns import stop_reports, unrun_text, workers
from diff_encoder_sim.api.notes import name_rates, name_stopping, name_stopping_of_trial, with_checks
from diff_encoder_sim.base.command_line import faults_of_trials
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.arguments import add_workers
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.robot_params import load_robot_params
from places import CONFIG, ROOT


def campaign(tmp_path, **overrides):
    path = tmp_path / 'campaign.yaml'
    settings = ', '.join(f'{key.replace("__", ".")}: {value}' for key, value in overrides.items())
    path.write_text(f'{{name: c, tests: [DLD], ppr: [40], robot: kobuki, set: {{{settings}}}}}')
    return load_campaign(str(path), ROOT)


def test_the_results_of_the_checks_go_into_the_manifest(tmp_path, capsys):
    checked = with_checks('campaign', campaign(tmp_path), False)
    robot = json.loads(json.dumps(checked.manifest()))['robot']
    assert robot['name'] == 'kobuki' and robot['file'].endswith('config/robots/kobuki.yaml')
    assert {row['quantity'] for row in robot['found']} >= {'mass [kg]', 'laser link'}
    assert len(robot['checks']) >= 6 and all(check['is_ok'] for check in robot['checks'])
    assert checked.fingerprint() == campaign(tmp_path).fingerprint()
    assert capsys.readouterr() == ('', '')


def test_a_robot_that_fails_stops_it_with_the_table(tmp_path, capsys):
    weak = campaign(tmp_path, simulator__drive__wheel_torque=0.001)
    with pytest.raises(
        ConfigError, match='the robot fails its self-check: .*; allowed: another robot or test, or --unch'
    ):
        with_checks('campaign', weak, False)
    assert 'NOT OK' in capsys.readouterr().err
    going_on = with_checks('campaign', weak, True)
    assert not all(check.is_ok for check in going_on.checks)
    assert 'campaign: ' in capsys.readouterr().err.splitlines()[-1]


def test_a_test_that_is_not_for_it_stops_it(tmp_path):
    with pytest.raises(
        ConfigError, match='test DLD: not for this robot: .* time_limit is 600 s; allowed: .*--unchecked'
    ):
        with_checks('advise', campaign(tmp_path, simulator__drive__max_linear_speed=0.1), False)


STOP, TOLERANCE = 'navigation.DWAPlannerROS.stop', 'navigation.DWAPlannerROS.xy_goal_tolerance'


def said(capsys, campaign, tolerance_m=0.05, tolerance_deg=3.0):
    name_stopping('campaign', campaign, tolerance_m, tolerance_deg)
    out, err = capsys.readouterr()
    assert out == ''
    return err.splitlines()


def test_each_stop_that_is_varied_has_its_line(tmp_path, capsys):
    assert said(capsys, small_campaign(tmp_path, nav='scripted')) == []
    lines = said(capsys, small_campaign(tmp_path, vary={STOP: ['latch', 'precise']}))
    assert [line.split()[2] for line in lines] == ['latch', 'precise']


def test_a_stop_that_spends_more_than_results_are_judged_by_is_a_warning(tmp_path, capsys):
    wide = {'set': {STOP: 'latch', TOLERANCE: 0.1}}
    _, warning = said(capsys, small_campaign(tmp_path, **wide))
    assert 'stopping may end 80 mm and 3.0 degrees from a goal with every encoder' in warning
    assert len(said(capsys, small_campaign(tmp_path, **wide), 0.081)) == 1
    assert len(said(capsys, small_campaign(tmp_path, **wide), 0.081, 2.0)) == 2
    wide['set'][STOP] = 'precise'
    assert len(said(capsys, small_campaign(tmp_path, **wide))) == 1


def test_a_live_trial_says_it_for_the_stack_it_runs(capsys):
    params = load_robot_params(CONFIG)
    for nav, expected in (('embedded', 'stopping: precise'), ('upstream', 'anywhere within 50 mm'), ('scripted', '')):
        name_stopping_of_trial(nav, params)
        assert expected in capsys.readouterr().err


def test_trials_that_could_not_be_run_are_named_by_reason():
    unrun = {'out of memory': [f'SL_90ppr_trial{k}' for k in range(7)], 'worker lost': ['SL_90ppr_trial9']}
    assert unrun_text('campaign', unrun).splitlines() == [
        'campaign: 7 trials could not be run (out of memory): '
        + ', '.join(f'SL_90ppr_trial{k}' for k in range(5))
        + ', ...',
        'campaign: 1 trial could not be run (worker lost): SL_90ppr_trial9',
        'campaign: run the same command again to retry them',
    ]


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_tool_with_its_status_and_says_how_many_trials_are_done(number, capsys):
    handlers = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]

    finished = SimpleNamespace(count=lambda: '12 of 40 trials')
    with pytest.raises(SystemExit) as ended, faults_of_trials('campaign'), stop_reports(finished):
        os.kill(os.getpid(), number)
    assert ended.value.code == 128 + number
    assert capsys.readouterr().err == (
        'campaign: stopped after 12 of 40 trials; run the same command again to continue\n'
    )
    assert [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)] == handlers


@pytest.mark.parametrize(
    'arguments',
    [
        '--tls-ca a --tls-cert b',
        '--tls-ca a --tls-cert b --scheduler tcp://host:8786',
        '--tls-cert b --tls-key c --scheduler tls://host:8786',
        '--tls-ca a --workers 2',
    ],
)
def test_options_for_tls_without_a_cluster_that_uses_them_are_an_error(arguments):
    parser = argparse.ArgumentParser()
    add_workers(parser)
    with pytest.raises(ConfigError, match='^given --tls-.*; allowed: --tls-ca and --tls-cert, with --scheduler tls://'):
        workers(parser.parse_args(arguments.split()), 1)


def test_each_rate_that_joint_states_do_not_have_is_a_line(capsys):
    name_rates('advise', [20.0, 1000.0, 100.0, 150.0, 1000.0])
    out, err = capsys.readouterr()
    assert (out, err.splitlines()) == (
        '',
        [
            'advise: rate: 1000 Hz, but reports are limited to the 100 Hz of joint states',
            'advise: rate: 150 Hz, but reports are limited to the 100 Hz of joint states',
        ],
    )
