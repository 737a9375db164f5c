"""Campaigns and bags as datasets."""

import csv
import json
import math
import shutil

import pytest

from analysed_campaigns import finish, refusal
from campaign_files import NOISE, RUN, small_campaign
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.worker import ResultsFolder, run_group
from places import ROOT
from synthetic_trials import ALTO
from trial_bags import trial, write_bag


def test_nothing_finished_and_other_paths_beside_a_campaign_are_refused(folder, tmp_path):
    assert 'expected it alone' in refusal(folder, tmp_path)
    empty = finish(small_campaign(tmp_path), tmp_path / 'empty', 0)
    assert refusal(empty) == f'{empty}: no trial is finished; expected at least one'
    (empty / 'trials.csv').unlink()
    assert refusal(empty).startswith(f'{empty}/trials.csv: no such file')


def test_what_can_be_analysed_is(tmp_path, caplog):
    write_bag(tmp_path / 'good.bag', trial())
    write_bag(tmp_path / 'no_odom.bag', trial(number=2), odom=())
    write_bag(tmp_path / 'no_truth.bag', trial(number=3), truth=())
    write_bag(tmp_path / 'nan.bag', trial(number=4), odom=[(math.nan, 0.0, 0.0)])
    write_bag(tmp_path / 'torn.bag', trial(number=5), result=None)
    dataset = load_dataset([tmp_path])
    assert [trial.outcome for trial in dataset.trials] == [Outcome.SUCCEEDED, Outcome.TORN]
    assert [record.message for record in caplog.records] == dataset.notes
    assert [note.split(':')[0].split('/')[-1] for note in dataset.notes] == ['nan.bag', 'no_odom.bag', 'no_truth.bag']
    assert dataset.notes[1].endswith('no message on /odom; expected nav_msgs/msg/Odometry')


def test_nothing_to_analyse_is_refused(tmp_path):
    assert refusal(tmp_path) == f"{tmp_path}: no bag in this folder, and no campaign's results"
    (tmp_path / 'a.bag').write_bytes(b'')
    assert refusal(tmp_path).startswith(f'{tmp_path}/a.bag: not a readable bag')


def test_a_campaign_that_goes_on_is_analysed_as_far_as_it_is(tmp_path, caplog):
    folder = finish(small_campaign(tmp_path), tmp_path / 'out', 3)
    with open(folder / 'trials.csv', 'ab') as table:
        table.write(b'SL,90,2,2,succ')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 3
    assert 'the last line is incomplete' in dataset.notes[0] and 'has 3 of 8 trials' in dataset.notes[1]
    assert [record.message for record in caplog.records] == dataset.notes


def test_a_manifest_of_another_campaign_is_named(folder, tmp_path):
    campaign = small_campaign(tmp_path, tests=['SL'], vary={NOISE: [0.01, 0.03]})
    other = finish(campaign, tmp_path / 'other', 1)
    shutil.copy(other / 'manifest.json', folder)
    assert f'{folder}/trials.csv: line 1 does not belong to the campaign of manifest.json' in refusal(folder)


@pytest.mark.parametrize(
    'change',
    [
        lambda lines: lines + lines[-1:],
        lambda lines: lines[:2] + ['SL,90'] + lines[3:],
        lambda lines: lines[:1] + [lines[1].replace('SL,', 'LS,')] + lines[2:],
        lambda lines: lines[:1] + [lines[1].replace('49.05', 'nan')] + lines[2:],
        lambda lines: lines[:1] + [lines[1].replace('49.05', '1e300')] + lines[2:],
    ],
)
def test_lines_that_are_no_rows_are_named(folder, change):
    path = folder / 'trials.csv'
    path.write_text('\n'.join(change(path.read_text().splitlines())) + '\n')
    assert refusal(folder).startswith(f'{path}: line ')


def test_a_campaign_is_its_table_and_the_way_from_its_bags(finished):
    dataset = load_dataset([finished])
    assert (dataset.title, dataset.folder, dataset.robot, dataset.notes) == ('small', finished, ALTO, [])
    assert dataset.manifest == json.loads((finished / 'manifest.json').read_text())
    assert {test: (trial.test, trial.nav) for test, trial in dataset.requested.items()} == {
        test: (load_test(test, ROOT / 'config'), 'embedded') for test in ('SL', 'SMT')
    }
    assert [(trial.test, trial.ppr, trial.trial, trial.seed) for trial in dataset.trials] == [
        (test, ppr, number, number) for test in ('SL', 'SMT') for ppr in ('40', '90') for number in (1, 2)
    ]
    second = dataset.trials[1]
    assert second.errors[PoseSource.ODOM] == (1 / 3, -1e-17, 0.0) and second.duration_s == 50.05
    assert second.bag == finished / 'bags' / 'SL_40_002.bag' and len(second.tracks.true) == 3
    assert set(second.paths) == set(PoseSource) - {PoseSource.WORLD} and second.paths[PoseSource.AMCL] is None
    assert second.paths[PoseSource.ODOM].ate_rmse_m == pytest.approx(math.sqrt((0.3**2 + 0.1**2 + 0.4**2) / 3))


def test_real_encoders_and_variants_come_with_the_trials(tmp_path):
    variants = {'a none': {}, 'missed 1 %': {'config.encoder.faults.missed': 0.01}}
    campaign = small_campaign(tmp_path, tests=['SL'], ppr=[40], encoders=['amt102'], variants=variants)
    dataset = load_dataset([finish(campaign, tmp_path / 'out')])
    assert dataset.notes == [] and all(trial.paths for trial in dataset.trials)
    assert [(cell.ppr, cell.varied) for cell in dataset.cells()] == [
        (label, (('variant', name),)) for name in variants for label in ('40', '8192 amt102')
    ]
    assert [encoder['label'] for encoder in dataset.manifest['encoders']] == ['8192 amt102']
    assert dataset.manifest['encoders'][0]['resolution'] == '2048 lines x 4 = 8192 counts per wheel revolution'


def test_bags_that_do_not_fit_are_named_and_their_rows_stay(folder):
    bags = folder / 'bags'
    (bags / 'SL_40_001.bag').write_bytes(b'')
    shutil.copy(bags / 'SMT_90_001.bag', bags / 'SL_40_002.bag')
    (bags / 'SL_90_001.bag').unlink()
    write_bag(bags / 'SL_90_001.bag', trial(number=1, ppr=90, nav='embedded', wheel_diameter=0.15))
    shutil.copy(bags / 'SL_90_002.bag', bags / 'mine.bag')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 8 and [trial.bag is None for trial in dataset.trials] == 3 * [True] + 5 * [False]
    assert dataset.notes[0] == f'{bags}/mine.bag: not a bag of trials.csv (1 such); left out'
    assert f'{bags}/SL_40_001.bag: not a readable bag' in dataset.notes[1]
    assert f'{bags}/SL_40_002.bag: differs in test, number, ppr from its line in trials.csv' in dataset.notes[2]
    assert f'{bags}/SL_90_001.bag: differs in wheel_diameter, wheel_separation from its line' in dataset.notes[3]


TOUR = str(ROOT / 'test' / 'rostest' / 'data' / 'short_tour.yaml')
MADE_WITH = {'tests': [TOUR], 'ppr': [90], 'nav': 'scripted'}


def run_campaign(folder, **changes):
    """The campaign's folder, after trials in this process."""
    (folder / 'scratch').mkdir(parents=True)
    campaign, out = small_campaign(folder, **MADE_WITH, **changes), folder / 'out'
    with ResultStore(out, campaign, RUN) as store:
        (out / 'probe').write_text('nonce')
        files = campaign.files.materialise(folder / 'scratch')
        for trial in store.pending():
            ((row, _),) = run_group(files, [trial], ResultsFolder(str(out), 'probe', 'nonce'), run_trials)
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


@pytest.mark.parametrize('content', ['', '{', '[]', '{"name": "x"}', '{"name": "x", "configuration": {"tests": []}}'])
def test_a_manifest_that_is_none_is_named(folder, content):
    (folder / 'manifest.json').write_text(content)
    assert refusal(folder).startswith(f'{folder}/manifest.json: not the manifest of a campaign')


def test_without_bags_the_table_is_analysed_alone(folder):
    shutil.rmtree(folder / 'bags')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 8
    assert all((trial.paths, trial.tracks, trial.bag) == ({}, None, None) for trial in dataset.trials)
    assert dataset.notes == [f'{folder}/bags: has bags of 0 of 8 trials; the others have no errors along the path']
