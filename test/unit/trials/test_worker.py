"""Trials on a worker: where their bags go, and what is returned."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials import worker
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.trials_csv import TrialRow
from diff_encoder_sim.trials.worker import HostFault, ResultsFolder, run_group

POSE = Pose2D(0.1, 0.2, 0.3)
ERRORS = {PoseSource.ODOM: POSE, PoseSource.AMCL: None, PoseSource.GLOBAL: None, PoseSource.WORLD: POSE}
NAMES = ['bags/SL_40_001.bag', 'bags/SL_40_002.bag', 'bags/SL_40_003.bag']
CONTENTS = [b'bag of 1', b'bag of 2', b'bag of 3']


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / 'results'
    (folder / 'bags').mkdir(parents=True)
    (folder / '.probe-1').write_text('1')
    return ResultsFolder(str(folder), '.probe-1', '1')


def trials(setups, robot_file):
    return [trial(plan, robot_file) for plan, *_ in setups]


def trial(plan, robot_file):
    assert Path(plan.world).is_file() and Path(plan.map).is_file() and robot_file.is_file()
    if plan.bag:
        Path(plan.bag).write_bytes(b'bag of %d' % plan.trial.number)
    return TrialRow('', '', (), 0, 0, Outcome.LOST, 'no idea', 48.5, ERRORS, float(plan.trial.number))


def full_disk(setups, robot_file):
    raise OSError(28, 'No space left on device', setups[0].plan.bag)


def run(results, tmp_path, run=trials, **changes):
    changes = {'tests': ['SL'], 'ppr': [40.0], 'trials': 3, **changes}
    campaign = load_campaign('paper', package_folder(), changes)
    return run_group(campaign.files.materialise(tmp_path / 'scratch'), campaign.trials(), results, run)


def test_a_shared_folder_gets_the_bags_and_each_row_has_its_part_of_the_time(results, tmp_path, monkeypatch):
    clock = iter([100.0, 106.0])
    monkeypatch.setattr(worker, 'time', SimpleNamespace(perf_counter=lambda: next(clock)))
    rows, bags = zip(*run(results, tmp_path))
    assert bags == (None,) * 3
    assert [row.bag for row in rows] == NAMES
    assert [(Path(results.path) / name).read_bytes() for name in NAMES] == CONTENTS
    assert len(list((Path(results.path) / 'bags').iterdir())) == 3
    assert rows[1][:8] == ('SL', '40', (), 2, 2, Outcome.LOST, 'no idea', 48.5)
    assert (rows[1].errors, rows[1].distance_m, rows[1].wall_time_s) == (ERRORS, 2.0, 2.0)


@pytest.mark.parametrize('change', [{'nonce': 'of another run'}, {'probe': 'absent'}, {'path': '/nowhere'}])
def test_any_other_folder_gets_nothing_and_the_bags_are_returned(results, tmp_path, change):
    rows, bags = zip(*run(results._replace(**change), tmp_path))
    assert ([row.bag for row in rows], list(bags)) == (NAMES, CONTENTS)
    assert not list((Path(results.path) / 'bags').iterdir())
    assert not list((tmp_path / 'scratch').rglob('*.bag*'))


@pytest.mark.parametrize('nonce', ['1', 'of another run'])
def test_without_recording_there_is_no_bag(results, tmp_path, nonce):
    rows, bags = zip(*run(results._replace(nonce=nonce), tmp_path, record='none'))
    assert ({row.bag for row in rows}, set(bags)) == ({''}, {None})
    assert not list((Path(results.path) / 'bags').iterdir())


def test_a_full_disk_names_the_bag(results, tmp_path):
    with pytest.raises(HostFault, match='SL_40_001.bag.*No space left'):
        run(results, tmp_path, full_disk)
