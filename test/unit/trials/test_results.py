"""The results folder from its beginning to its end, rows of trials.csv, damage, and a full disk."""

import errno
import json
import re
import resource
import subprocess
import sys

import pytest

from campaign_files import NOISE, ROOT, RUN, TWO_NOISES, kill, refusal, row_of_trial, run, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials import results as module
from diff_encoder_sim.trials.results import ResultStore, describe_run, differences
from diff_encoder_sim.trials.trials_csv import header, line_of, row_of


def test_a_row_reads_back_exactly_except_for_wall_time(campaign):
    names = header([NOISE])
    assert names[:8] == ['test', 'ppr', NOISE, 'trial', 'seed', 'outcome', 'reason', 'duration_s']
    assert names[8] == 'odom_x_m' and names[-4:] == ['world_yaw_rad', 'distance_m', 'wall_time_s', 'bag']
    assert len(names) == len(set(names)) == 23
    for trial in campaign.trials():
        row = row_of_trial(trial, 'bags/x.bag', wall_time_s=1.23456789, duration_s=0.1 + 0.2)
        assert row_of(line_of(row), [NOISE]) == row._replace(wall_time_s=1.235)
    errors = {PoseSource.ODOM: None, PoseSource.AMCL: None, PoseSource.WORLD: (0.0, 1.0, 2.0)}
    line = line_of(row_of_trial(campaign.trials()[0], outcome=Outcome.ABORTED, errors=errors))
    fields = dict(zip(names, line.decode().split(',')))
    assert (fields['odom_x_m'], fields['global_yaw_rad'], fields['world_y_m']) == ('', '', '1.0')
    assert row_of(line, [NOISE]).errors == {**errors, PoseSource.GLOBAL: None}


@pytest.mark.parametrize('reason', ['a, "quoted" one', 'two\nlines\r\n', 'nul\0 tab\t esc\x1b \x85\u2028', "'"])
def test_whatever_the_reason_the_row_stays_a_line(campaign, reason):
    row = row_of_trial(campaign.trials()[0], outcome=Outcome.LOST, reason=reason)
    line = line_of(row)
    assert line.count(b'\n') == 1 and len(line.splitlines()) == 1 and b'\0' not in line
    assert row_of(line, [NOISE]).identity() == row.identity()


@pytest.mark.parametrize(
    'damage',
    [
        lambda lines: [*lines[:2], b'SL,40,0.01,1', *lines[3:]],
        lambda lines: [*lines, lines[2].replace(b'SL', b'XX')],
        lambda lines: [*lines, b'\xff\xfe'],
        lambda lines: [*lines, lines[1].replace(b'bags/', b'/etc/')],
        lambda lines: [*lines, lines[1].replace(b',1,1,', b',1,2,')],
        lambda lines: [lines[0].replace(b'_rad', b'_deg'), *lines[1:]],
        lambda lines: [*lines[:2], re.sub(rb',-?\d+\.\d+,', b',nan,', lines[2], count=1), *lines[3:]],
    ],
)
def test_a_damaged_table_is_named_with_its_line_and_not_changed(campaign, tmp_path, damage):
    folder = tmp_path / 'out'
    content = b'\n'.join([*damage(run(campaign, folder).splitlines()), b''])
    (folder / 'trials.csv').write_bytes(content)
    assert 'trials.csv: line ' in refusal(folder, campaign)
    assert (folder / 'trials.csv').read_bytes() == content


@pytest.mark.parametrize('missing', [0, 1])
def test_unfinished_files_are_removed_at_the_start_and_when_all_trials_are_done(campaign, tmp_path, missing):
    """In between a worker of another host may be writing them."""
    folder = tmp_path / 'out'
    kill(folder, campaign, 0)
    left = [folder / 'bags' / '.SL_40_001.bag.1.active', folder / '.trials.csv.1.active']
    for path in [*left, folder / 'report.html']:
        path.write_text('half')
    with ResultStore(folder, campaign, RUN) as store:
        assert not any(path.exists() for path in left) and (folder / 'report.html').exists()
        for trial in store.pending()[missing:]:
            store.append(row_of_trial(trial, trial.bag))
        left[0].write_text('half')
        store.finish()
    assert left[0].exists() == bool(missing)


def test_each_row_is_on_the_disk_at_once_and_only_once_and_in_the_end_in_order(campaign, tmp_path, whole):
    with ResultStore(tmp_path / 'out', campaign, RUN) as store:
        for count, trial in enumerate(reversed(campaign.trials()), start=1):
            for _ in range(2):
                store.append(row_of_trial(trial, trial.bag))
            assert len((tmp_path / 'out' / 'trials.csv').read_bytes().splitlines()) == 1 + count
        assert store.pending() == [] and store.finish().read_bytes() == whole


def test_a_campaign_without_bags_is_finished_by_its_table(tmp_path):
    campaign = small_campaign(tmp_path, record='none')
    table = run(campaign, tmp_path / 'out')
    assert not (tmp_path / 'out' / 'bags').exists() and b'.bag' not in table
    assert run(campaign, tmp_path / 'out') == table


def test_a_folder_of_other_things_is_not_touched(campaign, tmp_path):
    (tmp_path / 'thesis.tex').write_text('precious')
    assert "holds 'thesis.tex' and no manifest.json" in refusal(tmp_path, campaign)
    assert [path.name for path in tmp_path.iterdir()] == ['thesis.tex']


def test_a_folder_that_cannot_be_resumed_or_made_is_named(campaign, tmp_path):
    folder = tmp_path / 'new'
    assert 'nothing to resume' in refusal(folder, campaign, must_resume=True) and not folder.exists()
    kill(folder, campaign, 2)
    with ResultStore(folder, campaign, RUN, must_resume=True) as store:
        assert len(store.pending()) == 6
    (tmp_path / 'file').touch()
    for place in ('file', 'file/below', '/proc/campaign'):
        assert 'cannot be read or written: ' in refusal(tmp_path / place, campaign)


@pytest.fixture(name='full_disk')
def fixture_full_disk():
    """A function after which files cannot grow beyond this many bytes; writing ends in mid-line."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize('room', [0, 60])
def test_a_full_disk_is_named_and_complete_lines_stay(campaign, tmp_path, whole, full_disk, room):
    folder = tmp_path / 'out'
    kill(folder, campaign, 3)
    with ResultStore(folder, campaign, RUN) as store:
        content = (folder / 'trials.csv').read_bytes()
        trial = store.pending()[0]
        full_disk(len(content) + room)
        with pytest.raises(ConfigError, match='trials.csv: cannot be read or written: File too large'):
            store.append(row_of_trial(trial, trial.bag))
        assert (folder / 'trials.csv').read_bytes().startswith(content)
        assert trial in store.pending()
        full_disk(10)
        with pytest.raises(ConfigError, match='trials.csv: cannot be'):
            store.finish()
        assert (folder / 'trials.csv').read_bytes().startswith(content)
        full_disk(resource.RLIM_INFINITY)
    assert run(campaign, folder) == whole


def test_an_incomplete_last_line_is_dropped_wherever_it_ends(campaign, tmp_path, whole):
    folder = tmp_path / 'out'
    kill(folder, campaign, 3)
    table = folder / 'trials.csv'
    content = table.read_bytes()
    last = content.rstrip(b'\n').rfind(b'\n') + 1
    for end in range(last, len(content)):
        table.write_bytes(content[:end])
        with ResultStore(folder, campaign, RUN) as store:
            assert [trial.position for trial in store.pending()] == [2, 3, 4, 5, 6, 7], end
        assert table.read_bytes() == content[:last]
    for count in (0, 1, 50):  # of the header
        table.write_bytes(content[:count])
        with ResultStore(folder, campaign, RUN) as store:
            assert len(store.pending()) == 8
    table.unlink()
    assert run(campaign, folder) == whole


def test_a_trial_whose_bag_is_gone_is_run_again(campaign, tmp_path, whole, caplog):
    folder = tmp_path / 'out'
    run(campaign, folder)
    bags = sorted((folder / 'bags').iterdir())
    bags[0].unlink()
    bags[5].unlink()
    with ResultStore(folder, campaign, RUN) as store:
        assert [f'bags/{bag.name}' for bag in (bags[0], bags[5])] == [trial.bag for trial in store.pending()]
    assert run(campaign, folder) == whole and sorted((folder / 'bags').iterdir()) == bags
    assert not caplog.records  # the same code


def test_two_campaigns_do_not_write_into_one_folder(campaign, tmp_path, monkeypatch, caplog):
    def no_locks(*_):
        raise OSError(errno.ENOLCK, 'No locks available')

    with ResultStore(tmp_path, campaign, RUN):
        assert 'another campaign is writing here' in refusal(tmp_path, campaign)
    monkeypatch.setattr(module.fcntl, 'flock', no_locks)
    with ResultStore(tmp_path, campaign, RUN):
        assert 'no locks' in caplog.text


def test_the_manifest_is_there_before_the_first_trial_with_each_run_and_other_code_gives_a_warning(tmp_path, caplog):
    campaign, folder = small_campaign(tmp_path, files={'amcl': 'amcl'}), tmp_path / 'out'
    for about in (describe_run(ROOT, ['campaign', '--out', 'x']), RUN, {**RUN, 'versions': {'numpy': '2'}}):
        with ResultStore(folder, campaign, about):
            manifest = json.loads((folder / 'manifest.json').read_text())
    assert "versions.numpy: '" in caplog.text and "there, '2' here" in caplog.text
    assert manifest['fingerprint'] == campaign.fingerprint() == small_campaign(tmp_path).fingerprint()
    assert manifest['configuration'] == json.loads(json.dumps(campaign.resolved()))
    assert manifest['seeds'] == {'first': 1, 'last': 2} and manifest['name'] == 'small'
    assert manifest['config_files'] == {'amcl': 'amcl'}
    about, *others = manifest['runs']
    assert len(others) == 2
    assert about['command'] == ['campaign', '--out', 'x'] and about['started'].endswith('+00:00')
    assert about['versions']['python'] == sys.version.split()[0] and about['versions']['numpy']
    assert about['versions']['diff_encoder_sim'] and about['machine']['memory_bytes'] > 1e8
    assert {'host', 'cpu', 'cores', 'os'} <= set(about['machine'])


def test_the_commit_is_the_packages_own(tmp_path):
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


def test_another_configuration_is_refused_with_its_differences(campaign, tmp_path):
    kill(tmp_path / 'out', campaign, 1)
    before = {path: path.read_bytes() for path in (tmp_path / 'out').iterdir() if path.is_file()}
    text = refusal(tmp_path / 'out', small_campaign(tmp_path, **TWO_NOISES, trials=5))
    assert 'trials: 2 there, 5 here; allowed: the same configuration' in text
    text = refusal(tmp_path / 'out', small_campaign(tmp_path, vary={NOISE: [0.01, 0.04]}, ppr=[1, 2, 3], seed=9))
    assert text.count(' there, ') == 3 and 'more; allowed' in text
    assert {path: path.read_bytes() for path in before} == before
    expected = ["c: 0 there, '(absent)' here", "a.1: '(absent)' there, 4 here"]
    assert differences({'a': [1], 'c': 0}, {'a': [1, 4]}) == expected


@pytest.mark.parametrize('content', ['', '[]', '{"runs": [], "configuration": {}}'])
def test_a_damaged_manifest_is_named(campaign, tmp_path, content):
    (tmp_path / 'manifest.json').write_text(content)
    assert 'manifest.json: not the manifest of a campaign' in refusal(tmp_path, campaign)
    assert (tmp_path / 'manifest.json').read_text() == content
