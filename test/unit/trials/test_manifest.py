"""manifest.json: what it describes, how it differs from another, and damage."""

import json
import subprocess
import sys

import pytest

from campaign_files import NOISE, ROOT, TWO_NOISES, kill, refusal, small_campaign
from diff_encoder_sim.trials.results import ResultStore, describe_run, differences


def test_the_manifest_is_there_before_the_first_trial(campaign, tmp_path):
    with ResultStore(tmp_path, campaign, describe_run(ROOT, ['campaign', '--out', 'x'])):
        manifest = json.loads((tmp_path / 'manifest.json').read_text())
    assert manifest['fingerprint'] == campaign.fingerprint()
    assert manifest['configuration'] == json.loads(json.dumps(campaign.resolved()))
    assert manifest['seeds'] == {'first': 1, 'last': 2} and manifest['name'] == 'small'
    (about,) = manifest['runs']
    assert about['command'] == ['campaign', '--out', 'x'] and about['started'].endswith('+00:00')
    assert about['versions']['python'] == sys.version.split()[0] and about['versions']['numpy']
    assert about['versions']['diff_encoder_sim'] and about['machine']['memory_bytes'] > 1e8
    assert {'host', 'cpu', 'cores', 'os'} <= set(about['machine'])


def test_files_in_place_of_those_of_config_are_named(tmp_path):
    campaign = small_campaign(tmp_path, files={'amcl': 'amcl'})
    with ResultStore(tmp_path / 'out', campaign, describe_run(ROOT, [])):
        manifest = json.loads((tmp_path / 'out' / 'manifest.json').read_text())
    assert manifest['config_files'] == {'amcl': 'amcl'}
    assert campaign.fingerprint() == small_campaign(tmp_path).fingerprint()  # of equal values


def test_the_commit_is_the_packages_own(tmp_path):
    assert describe_run(tmp_path, [])['commit'] is None
    subprocess.run(['git', 'init', '-q', tmp_path], check=True)
    (tmp_path / 'package.xml').write_text('<package><version>9.9.9</version></package>')
    about = describe_run(tmp_path, [])
    assert about['commit'] is None  # in a checkout, but not of it
    assert about['versions']['diff_encoder_sim'] == '9.9.9'
    git = ['git', '-C', tmp_path, '-c', 'user.name=n', '-c', 'user.email=e@x']
    subprocess.run([*git, 'add', '.'], check=True)
    subprocess.run([*git, 'commit', '-qm', 'm'], check=True)
    commit = describe_run(tmp_path, [])['commit']
    assert len(commit['id']) == 40 and commit['is_dirty'] is False
    (tmp_path / 'new').touch()
    assert describe_run(tmp_path, [])['commit'] == {'id': commit['id'], 'is_dirty': True}


def test_another_configuration_is_refused_with_what_differs(campaign, tmp_path):
    kill(tmp_path / 'out', campaign, 1)
    before = {path: path.read_bytes() for path in (tmp_path / 'out').iterdir() if path.is_file()}
    other = small_campaign(tmp_path, **TWO_NOISES, trials=5)
    text = refusal(tmp_path / 'out', other)
    assert 'trials: 2 there, 5 here; allowed: the same configuration' in text
    other = small_campaign(tmp_path, vary={NOISE: [0.01, 0.04]}, ppr=[1, 2, 3], seed=9)
    text = refusal(tmp_path / 'out', other)
    assert text.count(' there, ') == 3 and 'more; allowed' in text
    assert {path: path.read_bytes() for path in before} == before


def test_differences_are_found_at_any_depth():
    assert differences({'a': {'b': [1, 2]}, 'c': 0}, {'a': {'b': [1, 3, 4]}, 'd': 0}) == [
        'a.b.1: 2 there, 3 here',
        "c: 0 there, '(absent)' here",
        "a.b.2: '(absent)' there, 4 here",
        "d: '(absent)' there, 0 here",
    ]
    assert differences({'a': {}}, {'a': []}) == []


@pytest.mark.parametrize('content', ['', '{', '[]', '{}', '{"runs": [], "configuration": {}}', '{"runs": [1]}'])
def test_a_damaged_manifest_is_named(campaign, tmp_path, content):
    (tmp_path / 'manifest.json').write_text(content)
    assert 'manifest.json: not the manifest of a campaign' in refusal(tmp_path, campaign)
    assert (tmp_path / 'manifest.json').read_text() == content
