"""A campaign has the same results whichever format its bags have."""

import csv

import pytest

from campaign_files import RUN, small_campaign
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.worker import PlacedJob, ResultsFolder, run_jobs
from places import ROOT

TOUR = str(ROOT / 'test' / 'rostest' / 'data' / 'short_tour.yaml')
MADE_WITH = {'tests': [TOUR], 'ppr': [90], 'nav': 'scripted'}


def run_campaign(folder, **changes):
    """The campaign's folder, after trials in this process."""
    (folder / 'scratch').mkdir(parents=True)
    campaign, out = small_campaign(folder, **MADE_WITH, **changes), folder / 'out'
    with ResultStore(out, campaign, RUN) as store:
        (out / 'probe').write_text('nonce')
        for job in store.pending():
            placed, results = PlacedJob(job, store.bag_path(job)), ResultsFolder(str(out), 'probe', 'nonce')
            ((row, _),) = run_jobs(campaign, [placed], results, run_trials, folder / 'scratch')
            store.append(row)
        store.finish()
    (out / 'probe').unlink()
    return out


@pytest.fixture(scope='module')
def ros1_and_mcap(tmp_path_factory):
    folder = tmp_path_factory.mktemp('formats')
    return [run_campaign(folder / name, bag_format=name) for name in ('ros1', 'mcap')]


def rows(folder):
    with open(folder / 'trials.csv', newline='') as file:
        return list(csv.DictReader(file))


def errors(dataset):
    """As text: NaN is not equal to itself."""
    return [repr((trial.errors, trial.paths)) for trial in dataset.trials]


def test_trials_csv_is_the_same_but_for_the_names_of_the_bags(ros1_and_mcap):
    ros1, mcap = (rows(folder) for folder in ros1_and_mcap)
    assert [row['bag'] for row in ros1] == ['bags/short_tour_90_001.bag', 'bags/short_tour_90_002.bag']
    assert [row['bag'] for row in mcap] == ['bags/short_tour_90_001.mcap', 'bags/short_tour_90_002.mcap']
    for row in (*ros1, *mcap):
        del row['bag'], row['wall_time_s']
    assert ros1 == mcap


def test_the_errors_along_the_paths_are_the_same(ros1_and_mcap):
    ros1, mcap = (load_dataset([folder]) for folder in ros1_and_mcap)
    assert ros1.notes == mcap.notes == []
    assert errors(ros1) == errors(mcap)
    assert ros1.trials[0].paths


def test_bags_alone_are_analysed_alike(ros1_and_mcap):
    ros1, mcap = (load_dataset([folder / 'bags']) for folder in ros1_and_mcap)
    assert len(ros1.trials) == 2
    assert errors(ros1) == errors(mcap)


def test_a_folder_is_not_completed_in_another_format(ros1_and_mcap, tmp_path):
    with pytest.raises(ConfigError, match='results of another configuration: bag_format'):
        ResultStore(ros1_and_mcap[1], small_campaign(tmp_path, **MADE_WITH), RUN)


def test_a_whole_folder_is_left_as_it_is(ros1_and_mcap, tmp_path):
    with ResultStore(ros1_and_mcap[1], small_campaign(tmp_path, **MADE_WITH, bag_format='mcap'), RUN) as store:
        assert store.pending() == []
