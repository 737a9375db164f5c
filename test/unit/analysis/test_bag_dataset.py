"""What comes of bags that belong to no campaign."""

import shutil

from analysed_campaigns import refusal
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.test_definition import load_test
from trial_bags import ROOT, trial, write_bag


def test_a_folder_of_campaigns_is_not_pooled(folder):
    assert (
        refusal(folder.parent) == f'{folder.parent}: holds the results of a campaign in {folder}; expected that folder'
    )


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


def test_real_encoders_and_variants_are_those_of_the_bags(tmp_path):
    amt102 = trial(ppr=8192, encoder='amt102', resolution='2048 lines x 4 = 8192 counts per wheel revolution')
    write_bag(tmp_path / 'a.bag', amt102)
    write_bag(tmp_path / 'b.bag', trial(ppr=8192))
    assert load_dataset([tmp_path]).encoders() == ['8192', '8192 amt102']
    write_bag(tmp_path / 'c.bag', trial(ppr=8192, variant='missed 1 %'))
    assert [one.varied for one in load_dataset([tmp_path]).trials] == [
        *[(('variant', ''),)] * 2,
        (('variant', 'missed 1 %'),),
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
