"""A campaign whose robot fails its self-check, or a test, does not begin."""

import json

import pytest

from diff_encoder_sim.api.notes import with_checks
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import manifest_of
from places import ROOT


def campaign(tmp_path, **overrides):
    path = tmp_path / 'campaign.yaml'
    settings = ', '.join(f'{key.replace("__", ".")}: {value}' for key, value in overrides.items())
    path.write_text(f'{{name: c, tests: [DLD], ppr: [40], robot: kobuki, set: {{{settings}}}}}')
    return load_campaign(str(path), ROOT)


def test_the_results_of_the_checks_go_into_the_manifest(tmp_path, capsys):
    checked = with_checks('campaign', campaign(tmp_path), False)
    robot = json.loads(json.dumps(manifest_of(checked, {})))['robot']
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
    assert not all(check.is_ok for check in going_on.robot.checks)
    assert 'campaign: ' in capsys.readouterr().err.splitlines()[-1]


def test_a_test_that_is_not_for_it_stops_it(tmp_path):
    with pytest.raises(
        ConfigError, match='test DLD: not for this robot: .* time_limit is 600 s; allowed: .*--unchecked'
    ):
        with_checks('advise', campaign(tmp_path, simulator__drive__max_linear_speed=0.1), False)
