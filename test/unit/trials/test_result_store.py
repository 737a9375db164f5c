"""The results folder from its beginning to its end, what is not overwritten, and a full disk."""

import csv
import resource

import pytest

from campaign_files import NOISE, RUN, kill, refusal, row_of_job, run, small_campaign
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.results import ResultStore

# ---- a folder from its beginning to its end


def test_the_table_is_in_job_order_whatever_the_order_of_ends(campaign, tmp_path, whole):
    jobs = campaign.jobs()
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
    jobs = campaign.jobs()
    with ResultStore(tmp_path, campaign, RUN) as store:
        for count, job in enumerate(reversed(jobs), start=1):
            row = row_of_job(campaign, job, store.bag_path(job))
            store.append(row)
            store.append(row)
            assert len((tmp_path / 'trials.csv').read_bytes().splitlines()) == 1 + count
        assert store.pending() == [] and [row.trial for row in store.rows] == [1, 2] * 4


def test_without_bags_there_is_no_folder_for_them(tmp_path):
    campaign = small_campaign(tmp_path, record='none')
    table = run(campaign, tmp_path / 'out')
    assert not (tmp_path / 'out' / 'bags').exists() and b'.bag' not in table
    assert run(campaign, tmp_path / 'out') == table


# ---- what is refused


def test_a_folder_of_other_things_is_not_touched(campaign, tmp_path):
    (tmp_path / 'thesis.tex').write_text('precious')
    assert "holds 'thesis.tex' and no manifest.json" in refusal(tmp_path, campaign)
    assert [path.name for path in tmp_path.iterdir()] == ['thesis.tex']


@pytest.mark.parametrize('leftover', ['.lock', '.manifest.json.5.active'])
def test_what_a_kill_before_the_manifest_leaves_is_no_other_thing(campaign, tmp_path, leftover):
    (tmp_path / leftover).touch()
    with ResultStore(tmp_path, campaign, RUN) as store:
        assert len(store.pending()) == 8


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


@pytest.mark.parametrize('is_begun', [False, True])
def test_bags_that_are_a_link_elsewhere_are_refused_and_nothing_there_changes(campaign, tmp_path, is_begun):
    folder, elsewhere = tmp_path / 'out', tmp_path / 'elsewhere'
    elsewhere.mkdir()
    (elsewhere / 'my.bag.active').touch()
    if is_begun:
        kill(folder, campaign, 2)
        (folder / 'bags').rename(tmp_path / 'moved')
    folder.mkdir(exist_ok=True)
    (folder / 'bags').symlink_to(elsewhere)
    refused = refusal(folder, campaign)
    assert refused.startswith(f"{folder / 'bags'}: given a link to '{elsewhere}'; allowed: a folder")
    assert [path.name for path in elsewhere.iterdir()] == ['my.bag.active']


# ---- a full disk


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
        row = row_of_job(campaign, job, store.bag_path(job))
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
