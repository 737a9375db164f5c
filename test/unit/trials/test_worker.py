"""Trials on a worker: where their bags go, and what comes back."""

import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Ending, Outcome
from diff_encoder_sim.trials import worker
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.trial_run import TrialResult
from diff_encoder_sim.trials.worker import PlacedJob, ResultsFolder, run_jobs

BAG = 'bags/SL_40_002.bag'

ERRORS = {
    PoseSource.ODOM: Pose2D(0.1, 0.2, 0.3),
    PoseSource.AMCL: None,
    PoseSource.GLOBAL: None,
    PoseSource.WORLD: Pose2D(0.0, 0.0, 0.0),
}


@pytest.fixture(scope='module')
def campaign():
    return load_campaign('paper', package_folder(), {'tests': ['SL'], 'ppr': [40.0], 'trials': 3})


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / 'results'
    (folder / 'bags').mkdir(parents=True)
    (folder / '.probe-1').write_text('1')
    return ResultsFolder(str(folder), '.probe-1', '1')


def trials(setups, robot_file, record):
    return [trial(plan, robot_file) for plan, _ in setups]


def trial(plan, robot_file):
    assert Path(plan.world).is_file() and Path(plan.map).is_file() and robot_file.is_file()
    if plan.bag:
        Path(plan.bag).write_bytes(b'bag of %d' % plan.trial.number)
    return TrialResult(Ending(Outcome.LOST, 'no idea'), 48.5, float(plan.trial.number), ERRORS)


def full_disk(setups, robot_file, record):
    raise OSError(28, 'No space left on device', setups[0].plan.bag)


def test_a_shared_folder_gets_the_bag_and_the_row_says_where(campaign, results, tmp_path):
    ((row, bag),) = run_jobs(campaign, [PlacedJob(campaign.jobs()[1], BAG)], results, trials, tmp_path / 'scratch')
    assert bag is None
    assert (Path(results.path) / BAG).read_bytes() == b'bag of 2'
    assert row[:8] == ('SL', '40', (), 2, 2, Outcome.LOST, 'no idea', 48.5)
    assert (row.errors, row.distance_m, row.bag) == (ERRORS, 2.0, BAG)
    assert os.listdir(os.path.join(results.path, 'bags')) == ['SL_40_002.bag']


@pytest.mark.parametrize('change', [{'nonce': 'of another run'}, {'probe': 'absent'}, {'path': '/nowhere'}])
def test_any_other_folder_gets_nothing_and_the_bag_comes_back(campaign, results, tmp_path, change):
    scratch = tmp_path / 'scratch'
    placed = [PlacedJob(campaign.jobs()[1], BAG)]
    ((row, bag),) = run_jobs(campaign, placed, results._replace(**change), trials, scratch)
    assert (bag, row.bag) == (b'bag of 2', BAG)
    assert not os.listdir(os.path.join(results.path, 'bags'))
    assert not list(scratch.rglob('*.active'))


@pytest.mark.parametrize('nonce', ['1', 'of another run'])
def test_without_recording_there_is_no_bag(campaign, results, tmp_path, nonce):
    placed = [PlacedJob(campaign.jobs()[1], '')]
    ((row, bag),) = run_jobs(campaign, placed, results._replace(nonce=nonce), trials, tmp_path / 'scratch')
    assert (row.bag, bag) == ('', None)
    assert not os.listdir(os.path.join(results.path, 'bags'))


@pytest.mark.parametrize('nonce', ['1', 'of another run'])
def test_of_several_trials_each_gets_its_own_and_its_part_of_the_time(campaign, results, tmp_path, monkeypatch, nonce):
    placed = [PlacedJob(job, f'bags/{job.trial}.bag') for job in campaign.jobs()]
    clock = iter([100.0, 106.0])
    monkeypatch.setattr(worker, 'time', SimpleNamespace(perf_counter=lambda: next(clock)))
    finished = run_jobs(campaign, placed, results._replace(nonce=nonce), trials, tmp_path / 'scratch')
    assert [(row.trial, row.distance_m, row.bag) for row, _ in finished] == [
        (trial, float(trial), f'bags/{trial}.bag') for trial in (1, 2, 3)
    ]
    if nonce == '1':
        bags = [(Path(results.path) / row.bag).read_bytes() for row, _ in finished]
    else:
        bags = [bag for _, bag in finished]
    assert bags == [b'bag of 1', b'bag of 2', b'bag of 3']
    assert [row.wall_time_s for row, _ in finished] == [2.0, 2.0, 2.0]


def test_a_full_disk_names_the_bag(campaign, results, tmp_path):
    with pytest.raises(OSError) as caught:
        run_jobs(campaign, [PlacedJob(campaign.jobs()[1], BAG)], results, full_disk, tmp_path / 'scratch')
    assert 'SL_40_002.bag' in caught.value.filename
