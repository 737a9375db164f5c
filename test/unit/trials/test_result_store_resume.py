"""Campaigns that were killed and started again, and folders that were damaged in between."""

import json
import logging

import pytest

from campaign_files import RUN, kill, run
from diff_encoder_sim.trials.results import ResultStore


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
        assert [f'bags/{bag.name}' for bag in (bags[0], bags[5])] == [store.bag_path(job) for job in store.pending()]
    assert run(campaign, folder) == whole and sorted((folder / 'bags').iterdir()) == bags


def test_unfinished_files_go_and_others_stay(campaign, tmp_path):
    folder = tmp_path / 'out'
    kill(folder, campaign, 1)
    unfinished = [folder / 'bags' / 'SL_40_noise0.03_001.bag.active', folder / '.trials.csv.1.active']
    for path in [*unfinished, folder / 'report.html']:
        path.write_text('half')
    with ResultStore(folder, campaign, RUN):
        assert not any(path.exists() for path in unfinished) and (folder / 'report.html').exists()


def test_lines_that_came_twice_or_from_an_editor_count_once(campaign, tmp_path, whole):
    folder = tmp_path / 'out'
    head, *lines = run(campaign, folder).splitlines()
    (folder / 'trials.csv').write_bytes(b'\r\n'.join([head, *lines, *lines, b'']))
    assert run(campaign, folder) == whole


def test_each_run_is_told_in_the_manifest_and_other_code_is_warned_of(campaign, tmp_path, caplog):
    folder = tmp_path / 'out'
    kill(folder, campaign, 1)
    with caplog.at_level(logging.WARNING), ResultStore(folder, campaign, RUN):
        assert not caplog.records
    with ResultStore(folder, campaign, {**RUN, 'versions': {'numpy': '2'}}):
        assert "versions.numpy: '1' there, '2' here" in caplog.text
    assert len(json.loads((folder / 'manifest.json').read_text())['runs']) == 3
