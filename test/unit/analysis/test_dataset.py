"""Datasets: their order, and what comes of a campaign's folder and of bags that do not fit."""

import json
import math
import shutil

import numpy as np
import pytest

from campaign_files import NOISE, RUN, row_of_job, small_campaign
from diff_encoder_sim.analysis.bag_trial import MOST_POINTS
from diff_encoder_sim.analysis.dataset import CellKey, Dataset, RobotGeometry, TrialData
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_value
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.campaign.store import ResultStore
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.test_definition import load_test
from diff_encoder_sim.trials.trial_outcome import Outcome
from trial_bags import ROOT, TRUTH, trial, write_bag

ALTO = RobotGeometry(0.2, 0.4)


def data(test, ppr, number=1, varied=()):
    return TrialData(test, ppr, varied, number, number, Outcome.SUCCEEDED, '', 1.0, 1.0, {}, {}, None, None)


def finish(campaign, folder, count=None):
    """Run a campaign's trials: rows that are made up, and bags that are of the trials."""
    with ResultStore(folder, campaign, RUN) as store:
        for job in store.pending()[:count]:
            write_bag(folder / store.bag_path(job), campaign.trial_of(job))
            store.append(row_of_job(campaign, job, store.bag_path(job)))
        store.finish()
    return folder


@pytest.fixture(name='finished', scope='module')
def fixture_finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp('campaign')
    return finish(small_campaign(folder), folder / 'out')


@pytest.fixture(name='folder')
def fixture_folder(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / 'out')


def refusal(*paths):
    with pytest.raises(ConfigError) as caught:
        load_dataset(paths)
    assert '\n' not in str(caught.value)
    return str(caught.value)


# ---- order


def test_cells_are_in_the_papers_order():
    trials = [data(test, ppr) for test in ('office', 'DLD', 'SL') for ppr in ('ideal', '1024', '40', '90-1024')]
    cells = Dataset('', trials, [], None, None, ALTO, {}).cells()
    assert [cell[:2] for cell in cells] == [
        (test, ppr) for test in ('SL', 'DLD', 'office') for ppr in ('40', '1024', '90-1024', 'ideal')
    ]


def test_what_is_varied_is_not_pooled():
    trials = [data('SL', '40', number, ((NOISE, value),)) for value in ('0.03', '0.01') for number in (1, 2)]
    cells = Dataset('', trials, [], None, None, ALTO, {}).cells()
    assert list(cells) == [CellKey('SL', '40', ((NOISE, '0.03'),)), CellKey('SL', '40', ((NOISE, '0.01'),))]
    assert all(len(pooled) == 2 for pooled in cells.values())


def test_a_label_is_a_number_where_both_wheels_have_it():
    assert (ppr_value('1024'), ppr_value('90-1024'), ppr_value('ideal')) == (1024.0, None, None)


# ---- a campaign's folder


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


def test_without_bags_the_table_is_analysed_alone(folder):
    shutil.rmtree(folder / 'bags')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 8
    assert all((trial.paths, trial.tracks, trial.bag) == ({}, None, None) for trial in dataset.trials)
    assert dataset.notes == [f'{folder}/bags: has bags of 0 of 8 trials; the others have no errors along the path']


def test_a_campaign_that_goes_on_is_analysed_as_far_as_it_is(tmp_path, caplog):
    folder = finish(small_campaign(tmp_path), tmp_path / 'out', 3)
    with open(folder / 'trials.csv', 'ab') as table:
        table.write(b'SL,90,2,2,succ')
    dataset = load_dataset([folder])
    assert len(dataset.trials) == 3
    assert 'the last line is incomplete' in dataset.notes[0] and 'has 3 of 8 trials' in dataset.notes[1]
    assert [record.message for record in caplog.records] == dataset.notes


def test_varied_parameters_come_with_the_trials(tmp_path):
    folder = finish(small_campaign(tmp_path, tests=['SL'], vary={NOISE: [0.01, 0.03]}), tmp_path / 'out')
    assert [cell.varied for cell in load_dataset([folder]).cells()] == [
        ((NOISE, value),) for value in ('0.01', '0.03') for _ in range(2)
    ]


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


@pytest.mark.parametrize('content', ['', '{', '[]', '{"name": "x"}', '{"name": "x", "configuration": {"tests": []}}'])
def test_a_manifest_that_is_none_is_named(folder, content):
    (folder / 'manifest.json').write_text(content)
    assert refusal(folder).startswith(f'{folder}/manifest.json: not the manifest of a campaign')


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
    ],
)
def test_lines_that_are_no_rows_are_named(folder, change):
    path = folder / 'trials.csv'
    path.write_text('\n'.join(change(path.read_text().splitlines())) + '\n')
    assert refusal(folder).startswith(f'{path}: line ')


def test_nothing_finished_and_other_paths_beside_a_campaign_are_refused(folder, tmp_path):
    assert 'expected it alone' in refusal(folder, tmp_path)
    empty = finish(small_campaign(tmp_path), tmp_path / 'empty', 0)
    assert refusal(empty) == f'{empty}: no trial is finished; expected some'
    (empty / 'trials.csv').unlink()
    assert refusal(empty).startswith(f'{empty}/trials.csv: no such file')


def test_a_folder_of_campaigns_is_not_pooled(folder):
    assert refusal(folder.parent) == f'{folder.parent}: has a campaign in {folder}; expected that folder'


# ---- bags


def test_a_bag_tells_what_its_row_would(tmp_path):
    path = write_bag(tmp_path / 'a.bag', trial(number=7), believed=TRUTH[1:])
    dataset = load_dataset([path])
    (found,) = dataset.trials
    assert (dataset.title, dataset.manifest, dataset.folder, dataset.robot) == ('a', None, None, ALTO)
    assert found[:6] == ('SL', '40', (), 7, 7, Outcome.SUCCEEDED) and found.bag == path
    assert found.duration_s == pytest.approx(0.1) and found.distance_m == pytest.approx(10 + math.hypot(10, 0.1))
    assert set(found.errors) == set(PoseSource) and found.errors[PoseSource.AMCL] is None
    assert found.errors[PoseSource.ODOM] == pytest.approx((-0.1, 0.5, 0.05))  # seen from the start at (-10, 0)
    assert found.errors[PoseSource.WORLD] == pytest.approx((0.0, 0.1, 0.02))
    assert found.paths[PoseSource.ODOM].ate_max_m == pytest.approx(math.hypot(0.1, 0.4))
    assert found.paths[PoseSource.GLOBAL].poses == 2 and found.paths[PoseSource.AMCL] is None
    assert found.tracks.true.tolist() == [[-10.0, 0.0], [0.0, 0.0], [10.0, 0.1]]
    assert found.tracks.odometry == pytest.approx(np.array([[-10.0, 0.0], [0.0, 0.3], [9.9, 0.5]]))
    assert dataset.requested == {'SL': trial(number=7)}


def test_tracks_are_thinned_and_keep_their_ends(tmp_path):
    odom = [(0.01 * index, 0.0, 0.0) for index in range(3 * MOST_POINTS)]
    (found,) = load_dataset([write_bag(tmp_path / 'a.bag', trial(), odom=odom)]).trials
    assert found.tracks.odometry.shape == (MOST_POINTS, 2)
    assert found.tracks.odometry[[0, -1], 0] == pytest.approx([-10.0, -10.0 + odom[-1][0]])


def test_bags_are_sorted_into_cells(tmp_path):
    for ppr in (4096, 90):
        for number in (2, 1):
            write_bag(tmp_path / f'{ppr}_{number}.bag', trial(ppr=ppr, number=number))
    write_bag(tmp_path / 'ideal.bag', trial(odom='ideal'))
    dataset = load_dataset([tmp_path])
    assert dataset.title == tmp_path.name and dataset.notes == []
    assert [(trial.ppr, trial.trial) for trial in dataset.trials] == [
        ('90', 1),
        ('90', 2),
        ('4096', 1),
        ('4096', 2),
        ('ideal', 1),
    ]


def test_other_configurations_are_kept_apart(tmp_path):
    write_bag(tmp_path / 'a.bag', trial())
    write_bag(tmp_path / 'b.bag', trial(nav='embedded'))
    dataset = load_dataset([tmp_path])
    assert [trial.varied for trial in dataset.trials] == [(('nav', 'scripted'),), (('nav', 'embedded'),)]
    assert dataset.notes == [
        f'{tmp_path}/a.bag and others: nav is embedded or scripted; trials with different values are not pooled'
    ]


def test_a_trial_counts_once_and_a_test_has_one_definition(tmp_path):
    write_bag(tmp_path / 'a.bag', trial())
    shutil.copy(tmp_path / 'a.bag', tmp_path / 'b.bag')
    other = load_test('SL', ROOT / 'config').model_dump()
    write_bag(
        tmp_path / 'c.bag',
        trial().model_copy(update={'test': type(trial().test).from_mapping({**other, 'time_limit': 5.0}, '')}),
    )
    dataset = load_dataset([tmp_path])
    assert [trial.bag.name for trial in dataset.trials] == ['a.bag']
    assert 'b.bag: the same trial as ' in dataset.notes[0] and 'c.bag: defines SL differently from ' in dataset.notes[1]


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
    assert refusal(tmp_path) == f"{tmp_path}: no .bag file in this folder, and no campaign's results"
    (tmp_path / 'a.bag').write_bytes(b'')
    assert refusal(tmp_path).startswith(f'{tmp_path}/a.bag: not a readable bag')
