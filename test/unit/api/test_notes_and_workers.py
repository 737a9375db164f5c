"""What tools that run trials check and print before and after them."""

import io
import json
import os
import signal

import pytest

from campaign_files import small_campaign
from diff_encoder_sim.api.campaigns import unrun_text, workers
from diff_encoder_sim.api.notes import name_rates, name_stopping, name_stopping_of_trial, with_checks
from diff_encoder_sim.base.command_line import faults_of_trials
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.campaign import parse
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.progress import Progress
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from places import CONFIG, ROOT

STOP, TOLERANCE = 'navigation.DWAPlannerROS.stop', 'navigation.DWAPlannerROS.xy_goal_tolerance'


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


def test_a_robot_or_test_that_fails_stops_it_unless_unchecked(tmp_path, capsys):
    weak = campaign(tmp_path, simulator__drive__wheel_torque=0.001)
    with pytest.raises(ConfigError, match='the robot fails its self-check: .*; allowed: .* --unch'):
        with_checks('campaign', weak, False)
    assert 'NOT OK' in capsys.readouterr().err
    assert not all(check.is_ok for check in with_checks('campaign', weak, True).checks)
    assert 'campaign: ' in capsys.readouterr().err.splitlines()[-1]
    with pytest.raises(ConfigError, match='test DLD: not for this robot: .* time_limit is 600 s; allowed: .*--unch'):
        with_checks('advise', campaign(tmp_path, simulator__drive__max_linear_speed=0.1), False)


def said(capsys, campaign, tolerance_m=0.05, tolerance_deg=3.0):
    name_stopping('campaign', campaign, tolerance_m, tolerance_deg)
    out, err = capsys.readouterr()
    assert out == ''
    return err.splitlines()


def test_each_stop_has_its_line_and_one_that_spends_more_than_results_are_judged_by_a_warning(tmp_path, capsys):
    assert said(capsys, small_campaign(tmp_path, nav='scripted')) == []
    lines = said(capsys, small_campaign(tmp_path, vary={STOP: ['latch', 'precise']}))
    assert [line.split()[2] for line in lines] == ['latch', 'precise']
    wide = small_campaign(tmp_path, set={STOP: 'latch', TOLERANCE: 0.1})
    _, warning = said(capsys, wide)
    assert 'stopping may end 80 mm and 3.0 degrees from a goal with every encoder' in warning
    assert (len(said(capsys, wide, 0.081)), len(said(capsys, wide, 0.081, 2.0))) == (1, 2)
    assert len(said(capsys, small_campaign(tmp_path, set={STOP: 'precise', TOLERANCE: 0.1}))) == 1


def test_a_live_trial_says_it_for_the_stack_it_runs(capsys):
    params = override(load_robot_config(CONFIG), {})
    for nav, expected in (('embedded', 'stopping: precise'), ('upstream', 'anywhere within 50 mm'), ('scripted', '')):
        name_stopping_of_trial(nav, params)
        assert expected in capsys.readouterr().err


def test_trials_that_could_not_be_run_are_named_by_reason():
    unrun = {'out of memory': [f'SL_{k}' for k in range(7)], 'worker lost': ['SL_9']}
    first, second, _ = unrun_text('campaign', unrun).splitlines()
    assert first == 'campaign: 7 trials could not be run (out of memory): SL_0, SL_1, SL_2, SL_3, SL_4, ...'
    assert second == 'campaign: 1 trial could not be run (worker lost): SL_9'


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_tool_with_its_status_and_says_how_many_trials_are_done(number, tmp_path, capsys):
    handlers = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]
    small = small_campaign(tmp_path)
    progress = Progress(io.StringIO(), small, small.trials())
    with pytest.raises(SystemExit) as ended, faults_of_trials('campaign'), progress:
        os.kill(os.getpid(), number)
    assert ended.value.code == 128 + number
    assert capsys.readouterr().err.startswith('campaign: stopped after 0 of 8 trials; ')
    assert [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)] == handlers


def test_options_for_workers_that_contradict_each_other_are_an_error():
    arguments = '--config quick --out results --workers 2 --scheduler tcp://host:8786'
    with pytest.raises(ConfigError, match='^--workers, --scheduler: given both; allowed: one of them'):
        workers(parse(arguments.split()), 1)


def test_each_rate_that_joint_states_do_not_have_is_a_line(capsys):
    name_rates('advise', [20.0, 1000.0, 100.0, 150.0, 1000.0])
    line = 'advise: rate: {} Hz, but reports are limited to the 100 Hz of joint states\n'
    assert capsys.readouterr() == ('', line.format(1000) + line.format(150))
