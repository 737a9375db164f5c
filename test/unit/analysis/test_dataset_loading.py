"""What the user names: a campaign's folder alone, or bags."""

import math

from analysed_campaigns import finish, refusal
from campaign_files import small_campaign
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.trial_definition import Outcome
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
