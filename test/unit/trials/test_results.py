"""The results folder from its beginning to its end, what is not overwritten, and a full disk."""

import csv
import errno
import json
import logging
import resource
import subprocess
import sys

import pytest

from campaign_files import NOISE, ROOT, RUN, TWO_NOISES, kill, refusal, row_of_job, run, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials import results as results_lock
from diff_encoder_sim.trials.results import ResultStore, describe_run, differences


def test_the_table_is_in_job_order_whatever_the_order_of_ends(campaign, tmp_path, whole):
    jobs = campaign.trials()
    assert run(campaign, tmp_path / 'turned', reversed(jobs)) == whole
    with open(tmp_path / 'turned' / 'trials.csv', newline='', encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    assert [(row['ppr'], row[NOISE], row['trial'], row['seed']) for row in rows] == [
        (ppr, noise, trial, trial) for noise in ('0.01', '0.03') for ppr in ('40', '90') for trial in '12'
    ]
    assert {row['bag'] for row in rows} == {f'bags/{path.name}' for path in (tmp_path / 'turned' / 'bags').iterdir()}


@pytest.mark.parametrize('missing', [0, 1])
def test_what_a_killed_worker_left_goes_when_all_trials_are_done(campaign, tmp_path, missing):
    """Before, a worker of another host may be at it."""
    left = tmp_path / 'out' / 'bags' / '.SL_40_001.bag.1.active'
    with ResultStore(tmp_path / 'out', campaign, RUN) as store:
        for job in store.pending()[missing:]:
            store.append(row_of_job(campaign, job))
        left.write_text('half')
        store.finish()
    assert left.exists() == bool(missing)


def test_each_row_is_on_the_disk_at_once_and_comes_once(campaign, tmp_path):
    jobs = campaign.trials()
    with ResultStore(tmp_path, campaign, RUN) as store:
        for count, job in enumerate(reversed(jobs), start=1):
            row = row_of_job(campaign, job, job.bag)
            store.append(row)
            store.append(row)
            assert len((tmp_path / 'trials.csv').read_bytes().splitlines()) == 1 + count
        assert store.pending() == [] and [row.trial for row in store.rows] == [1, 2] * 4


def test_without_bags_there_is_no_folder_for_them(tmp_path):
    campaign = small_campaign(tmp_path, record='none')
    table = run(campaign, tmp_path / 'out')
    assert not (tmp_path / 'out' / 'bags').exists() and b'.bag' not in table
    assert run(campaign, tmp_path / 'out') == table


def test_a_folder_of_other_things_is_not_touched(campaign, tmp_path):
    (tmp_path / 'thesis.tex').write_text('precious')
    assert "holds 'thesis.tex' and no manifest.json" in refusal(tmp_path, campaign)
    assert [path.name for path in tmp_path.iterdir()] == ['thesis.tex']


def test_resume_needs_results_and_makes_no_folder(campaign, tmp_path):
    folder = tmp_path / 'new'
    assert 'nothing to resume' in refusal(folder, campaign, must_resume=True)
    assert not folder.exists()
    kill(folder, campaign, 2)
    with ResultStore(folder, campaign, RUN, must_resume=True) as store:
        assert len(store.pending()) == 6


@pytest.mark.parametrize('place', ['file', 'file/below', '/proc/campaign'])
def test_a_folder_that_cannot_be_is_named(campaign, tmp_path, place):
    (tmp_path / 'file').touch()
    assert 'cannot be read or written: ' in refusal(tmp_path / place, campaign)


@pytest.fixture(name='full_disk')
def fixture_full_disk():
    """A function after which files cannot grow beyond so many bytes; writing ends in mid-line."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize('room', [0, 1, 60])
def test_a_full_disk_is_named_and_what_was_whole_stays(campaign, tmp_path, whole, full_disk, room):
    folder = tmp_path / 'out'
    kill(folder, campaign, 3)
    with ResultStore(folder, campaign, RUN) as store:
        content = (folder / 'trials.csv').read_bytes()
        job = store.pending()[0]
        row = row_of_job(campaign, job, job.bag)
        full_disk(len(content) + room)
        with pytest.raises(ConfigError, match='trials.csv: cannot be read or written: File too large'):
            store.append(row)
        assert (folder / 'trials.csv').read_bytes() == content
        assert job in store.pending()
        full_disk(10)
        with pytest.raises(ConfigError, match='trials.csv: cannot be'):
            store.finish()
        assert (folder / 'trials.csv').read_bytes() == content
        full_disk(resource.RLIM_INFINITY)
    assert run(campaign, folder) == whole


def test_a_torn_last_line_is_dropped_wherever_it_was_torn(campaign, tmp_path, whole):
    folder = tmp_path / 'out'
    kill(folder, campaign, 3)
    table = folder / 'trials.csv'
    content = table.read_bytes()
    last = content.rstrip(b'\n').rfind(b'\n') + 1
    for end in range(last, len(content)):
        table.write_bytes(content[:end])
        with ResultStore(folder, campaign, RUN) as store:
            assert [job.position for job in store.pending()] == [2, 3, 4, 5, 6, 7], end
        assert table.read_bytes() == content[:last]
    table.write_bytes(content)
    with ResultStore(folder, campaign, RUN) as store:
        assert [job.position for job in store.pending()] == [3, 4, 5, 6, 7]
    assert run(campaign, folder) == whole


@pytest.mark.parametrize('count', range(9))
def test_after_a_kill_at_any_trial_the_table_becomes_the_undisturbed_one(campaign, tmp_path, whole, count):
    kill(tmp_path / 'out', campaign, count, order=lambda jobs: jobs[::-1])
    assert run(campaign, tmp_path / 'out') == whole


@pytest.mark.parametrize('count', [0, 1, 7, 50])
def test_a_torn_first_line_or_no_table_begins_the_table_again(campaign, tmp_path, whole, count):
    folder = tmp_path / 'out'
    kill(folder, campaign, 0)
    (folder / 'trials.csv').write_bytes((folder / 'trials.csv').read_bytes()[:count])
    assert run(campaign, folder) == whole
    (folder / 'trials.csv').unlink()
    assert run(campaign, folder) == whole


def test_a_trial_whose_bag_is_gone_is_run_again(campaign, tmp_path, whole):
    folder = tmp_path / 'out'
    run(campaign, folder)
    bags = sorted((folder / 'bags').iterdir())
    bags[0].unlink()
    bags[5].unlink()
    with ResultStore(folder, campaign, RUN) as store:
        assert [f'bags/{bag.name}' for bag in (bags[0], bags[5])] == [job.bag for job in store.pending()]
    assert run(campaign, folder) == whole and sorted((folder / 'bags').iterdir()) == bags


def test_unfinished_files_go_and_others_stay(campaign, tmp_path):
    folder = tmp_path / 'out'
    kill(folder, campaign, 1)
    unfinished = [folder / 'bags' / 'SL_40_noise0.03_001.bag.active', folder / '.trials.csv.1.active']
    for path in [*unfinished, folder / 'report.html']:
        path.write_text('half')
    with ResultStore(folder, campaign, RUN):
        assert not any(path.exists() for path in unfinished) and (folder / 'report.html').exists()


def test_each_run_is_told_in_the_manifest_and_other_code_is_warned_of(campaign, tmp_path, caplog):
    folder = tmp_path / 'out'
    kill(folder, campaign, 1)
    with caplog.at_level(logging.WARNING), ResultStore(folder, campaign, RUN):
        assert not caplog.records
    with ResultStore(folder, campaign, {**RUN, 'versions': {'numpy': '2'}}):
        assert "versions.numpy: '1' there, '2' here" in caplog.text
    assert len(json.loads((folder / 'manifest.json').read_text())['runs']) == 3


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


def test_two_campaigns_do_not_write_into_one_folder(campaign, tmp_path):
    with ResultStore(tmp_path, campaign, RUN):
        assert 'another campaign is writing here' in refusal(tmp_path, campaign)
    with ResultStore(tmp_path, campaign, RUN):
        pass


def test_without_locks_there_is_a_warning(campaign, tmp_path, monkeypatch, caplog):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, 'No locks available')

    monkeypatch.setattr(results_lock.fcntl, 'flock', no_locks)
    with ResultStore(tmp_path, campaign, RUN):
        assert 'no locks' in caplog.text
