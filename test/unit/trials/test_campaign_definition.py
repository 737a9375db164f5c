"""What determines a campaign's results: all of it is in the fingerprint, and nothing else."""

import json
import pickle

import pytest
import yaml

from campaign_files import NOISE, ROOT, SMALL, campaign_file, package_copy, small_campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign

MODULUS = 'config.counter_modulus'
VARY = {NOISE: [0.01, 0.03], MODULUS: [0, 65536]}


def test_a_campaign_survives_pickling_and_is_small(tmp_path):
    campaign = small_campaign(tmp_path)
    content = pickle.dumps(campaign)
    assert len(content) < 50_000
    assert pickle.loads(content) == campaign
    assert pickle.loads(content).fingerprint() == campaign.fingerprint()


def test_resolved_is_json_and_holds_every_parameter(tmp_path):
    resolved = small_campaign(tmp_path, vary=VARY).resolved()
    assert json.loads(json.dumps(resolved)) == resolved
    assert len(resolved['parameters']) == 4 and len(resolved['tests']) == 2
    for parameters in resolved['parameters']:
        assert parameters['amcl']['odom_alpha1'] == 0.2  # upstream's default, in no file
        assert parameters['simulator']['lidar']['noise'] == parameters['varied'][NOISE]


def test_any_change_changes_the_fingerprint_and_order_does_not(tmp_path):
    def fingerprint(**changes):
        return small_campaign(tmp_path, **changes).fingerprint()

    one = {'amcl.kld_err': 0.03, 'config.rate': 10.0}
    prints = [
        fingerprint(),
        fingerprint(trials=3),
        fingerprint(seed=1),
        fingerprint(ppr=[40, 91]),
        fingerprint(tests=['SL']),
        fingerprint(tests=['SMT', 'SL']),
        fingerprint(nav='scripted'),
        fingerprint(record='full'),
        fingerprint(set=one),
        fingerprint(vary=VARY),
        fingerprint(vary={**VARY, MODULUS: [0, 256]}),
        fingerprint(set={**one, 'config.rate': 11.0}),
    ]
    assert len(set(prints)) == len(prints)
    assert fingerprint(name='other') == prints[0]
    path = tmp_path / 'turned.yaml'
    content = {**SMALL, 'set': one, 'vary': VARY}
    path.write_text(yaml.safe_dump(content, sort_keys=True))
    sorted_print = load_campaign(str(path), ROOT).fingerprint()
    path.write_text(
        yaml.safe_dump(
            {
                key: dict(reversed(list(value.items()))) if isinstance(value, dict) else value
                for key, value in reversed(list(content.items()))
            },
            sort_keys=False,
        )
    )
    assert load_campaign(str(path), ROOT).fingerprint() == sorted_print


def test_every_parameter_of_every_file_is_in_the_fingerprint(tmp_path):
    package = package_copy(tmp_path / 'package')
    path = str(campaign_file(tmp_path))
    before = load_campaign(path, package).fingerprint()
    for name, old, new in (
        ('config.yaml', 'max_wheel_speed: 100.0', 'max_wheel_speed: 101.0'),
        ('simulator.yaml', 'command_timeout: 0.5', 'command_timeout: 0.6'),
        ('amcl.yaml', 'kld_err: 0.02', 'kld_err: 0.021'),
        ('navigation.yaml', 'occdist_scale: 0.02', 'occdist_scale: 0.03'),
        ('tests/SL.yaml', 'x: 10.0', 'x: 10.5'),
    ):
        file = package / 'config' / name
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new))
        assert load_campaign(path, package).fingerprint() != before, name
        file.write_text(text)
    assert load_campaign(path, package).fingerprint() == before


@pytest.mark.parametrize(
    ('name', 'change'),
    [
        ('worlds/hallway.world', lambda content: content + b' '),
        ('urdf/alto.urdf.xacro', lambda content: content + b'\n'),
        ('worlds/hallway.pgm', lambda content: content[:-1] + bytes([content[-1] ^ 1])),
        ('worlds/hallway.yaml', lambda content: content.replace(b'0.196', b'0.197')),
    ],
)
def test_every_byte_of_what_trials_read_is_in_the_fingerprint(tmp_path, name, change):
    package, path = package_copy(tmp_path / 'package'), str(campaign_file(tmp_path))
    before = load_campaign(path, package).fingerprint()
    file = package / name
    file.write_bytes(change(file.read_bytes()))
    assert load_campaign(path, package).fingerprint() != before
