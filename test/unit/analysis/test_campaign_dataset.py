"""What comes of a campaign's folder, and of bags that do not fit."""

import json
import math
import shutil

import pytest

from analysed_campaigns import finish
from campaign_files import NOISE, small_campaign
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.topics import PoseSource
from synthetic_trials import ALTO
from trial_bags import ROOT, trial, write_bag


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


def test_varied_parameters_come_with_the_trials(tmp_path):
    folder = finish(small_campaign(tmp_path, tests=['SL'], vary={NOISE: [0.01, 0.03]}), tmp_path / 'out')
    assert [cell.varied for cell in load_dataset([folder]).cells()] == [
        ((NOISE, value),) for value in ('0.01', '0.03') for _ in range(2)
    ]


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
