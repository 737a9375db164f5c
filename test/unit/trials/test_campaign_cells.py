"""Combinations of parameters, the fingerprint of a campaign, and the checks before its trials."""

import json
import pickle

import pytest
import yaml

from campaign_files import NOISE, ROOT, campaign_file, package_copy, small_campaign
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.trials.campaign_cells import CampaignParams, check_robot, unfit_tests
from diff_encoder_sim.trials.campaign_loading import load_campaign
from places import WORLDS

WIDE = [[0.3, 0.75], [-0.3, 0.75], [-0.3, -0.75], [0.3, -0.75]]
RATE, MISSED, MODULUS = 'config.rate', 'config.encoder.faults.missed', 'config.counter_modulus'
VARY = {NOISE: [0.01, 0.03], MODULUS: [0, 65536]}


def params(**changes):
    return CampaignParams.from_mapping({'name': 'a', 'tests': ['SL'], 'ppr': [40], **changes}, '')


def test_variants_are_multiplied_by_varied_parameters_and_not_by_each_other():
    one = params(set={RATE: 10.0})
    assert (one.varied_keys, list(one.combinations()), one.combination_count()) == ([], [()], 1)
    assert one.values_of(()) == {RATE: 10.0}
    three = params(variants={'none': {}, 'missed': {MISSED: 0.01}, 'slow': {RATE: 5.0}}, set={RATE: 10.0})
    assert list(three.combinations()) == [(('variant', name),) for name in ('none', 'missed', 'slow')]
    values = [three.values_of(varied) for varied in three.combinations()]
    assert values == [{RATE: 10.0}, {RATE: 10.0, MISSED: 0.01}, {RATE: 5.0}]
    four = params(variants={'none': {}, 'missed': {MISSED: 0.01}}, vary={NOISE: [0.01, 0.03]})
    assert four.varied_keys == [NOISE, 'variant'] and four.combination_count() == 4
    last = list(four.combinations())[-1]
    assert last == ((NOISE, 0.03), ('variant', 'missed'))
    assert four.values_of(last) == {NOISE: 0.03, MISSED: 0.01}


def test_what_a_worker_gets_survives_pickling_and_is_small(tmp_path):
    campaign = small_campaign(tmp_path)
    sent = campaign.files, campaign.trials()[0]
    assert pickle.loads(pickle.dumps(sent)) == sent
    assert [len(pickle.dumps(each)) < most for each, most in zip(sent, (30_000, 20_000))] == [True, True]


def test_resolved_is_json_and_contains_every_parameter(tmp_path):
    resolved = small_campaign(tmp_path, vary=VARY).resolved()
    assert json.loads(json.dumps(resolved)) == resolved
    assert len(resolved['parameters']) == 4 and len(resolved['tests']) == 2
    for parameters in resolved['parameters']:
        assert parameters['amcl']['odom_alpha1'] == 0.2  # upstream's default, in no file
        assert parameters['simulator']['lidar']['noise'] == parameters['varied'][NOISE]


def test_any_change_changes_the_fingerprint_and_names_and_order_do_not(tmp_path):
    amt102 = yaml.safe_load((ROOT / 'config' / 'encoders' / 'amt102.yaml').read_text())

    def fingerprint(encoder=None, **changes):
        (tmp_path / 'mine.yaml').write_text(yaml.safe_dump({**amt102, **(encoder or {})}))
        encoders = {'encoders': ['xl430', 'mine.yaml']} if encoder is not None else {}
        return small_campaign(tmp_path, **encoders, **changes).fingerprint()

    one, edges = {'amcl.kld_err': 0.03, RATE: 10.0}, {**amt102['encoder'], 'edge_error': 0.01}
    changes = [{}, {'trials': 3}, {'seed': 1}, {'ppr': [40, 91]}, {'tests': ['SL']}, {'tests': ['SMT', 'SL']}]
    changes += [{'nav': 'scripted'}, {'record': 'full'}, {'bag_format': 'mcap'}, {'set': one}, {'vary': VARY}]
    changes += [{'vary': {**VARY, MODULUS: [0, 256]}}, {'set': {**one, RATE: 11.0}}, {'encoder': {}}]
    changes += [{'encoder': {'encoder': edges}}, {'encoder': {'config': {'rate': 50.0}}}]
    prints = [fingerprint(**each) for each in changes]
    assert len(set(prints)) == len(prints)
    assert fingerprint(name='other') == prints[0]
    assert fingerprint(encoder={'name': 'other'}) == fingerprint(encoder={})
    both = [{'set': dict(pairs), 'vary': VARY} for pairs in (one.items(), reversed(list(one.items())))]
    assert fingerprint(**both[0]) == fingerprint(**dict(reversed(list(both[1].items()))))


@pytest.mark.parametrize(
    ('name', 'old', 'new'),
    [
        ('config/config.yaml', b'max_wheel_speed: 100.0', b'max_wheel_speed: 101.0'),
        ('config/amcl.yaml', b'kld_err: 0.02', b'kld_err: 0.021'),
        ('config/tests/SL.yaml', b'x: 10.0', b'x: 10.5'),
        ('worlds/hallway.world', b'</sdf>', b'</sdf> '),
        ('urdf/alto.urdf.xacro', b'</robot>', b'</robot> '),
        ('worlds/hallway.pgm', b'\xfe', b'\xcd'),
        ('worlds/hallway.yaml', b'0.196', b'0.197'),
    ],
)
def test_every_parameter_and_byte_that_trials_read_is_in_the_fingerprint(tmp_path, name, old, new):
    package, path = package_copy(tmp_path / 'package'), str(campaign_file(tmp_path))
    before = load_campaign(path, package).fingerprint()
    content = (package / name).read_bytes()
    assert old in content
    (package / name).write_bytes(content.replace(old, new, 1))
    assert load_campaign(path, package).fingerprint() != before


def test_a_robot_too_wide_or_too_slow_for_a_test_gets_one_line(tmp_path):
    def unfit(values=None, **changes):
        given = {'tests': ['SMT', 'DLD'], 'set': values or {}, **changes}
        return unfit_tests(small_campaign(tmp_path, **given), WORLDS)

    assert unfit() == []
    (line,) = unfit({f'navigation.{name}_costmap.footprint': WIDE for name in ('global', 'local')})
    assert line.startswith('test DLD: not for this robot: ')
    (line,) = unfit({'simulator.drive.max_linear_speed': 0.1})
    assert line.startswith('test DLD: ') and 'time_limit is 600 s' in line
    assert unfit({'simulator.drive.max_linear_speed': 0.01}, nav='scripted', tests=['SL']) == []


def test_the_self_check_is_of_the_robot_and_not_of_its_wheel_errors(tmp_path):
    """Else a campaign with wheel errors on purpose would never begin."""
    errors = SimulatorParams.from_mapping({'wheel_errors': {'left_radius_error': 0.02}}, '')
    checks = check_robot(small_campaign(tmp_path).robot.file.source, errors)
    assert [check.name for check in checks if not check.is_ok] == []
