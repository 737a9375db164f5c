"""Bags as datasets."""

import math
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

from analysed_campaigns import refusal
from diff_encoder_sim.analysis.bag_dataset import MOST_POINTS, goal_errors
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome, Trial
from diff_encoder_sim.drives.trial_recording import read_trial
from places import SOURCE
from synthetic_trials import ALTO
from trial_bags import ROOT, TRUTH, trial, write_bag


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


def test_a_bag_tells_what_its_row_would(tmp_path):
    path = write_bag(tmp_path / 'a.bag', trial(number=7), estimated=TRUTH[1:])
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


# One write a line: print makes two of it where Python's output is not buffered, and two processes write.
INTERRUPTED = """
import os, time
from diff_encoder_sim.analysis import bag_dataset as bag_trial

def read(path):
    os.write(1, b'reading\\n')
    time.sleep(0.3)

bag_trial._trial_or_reason, bag_trial.usable_cores = read, lambda: 2
try:
    bag_trial.read_bag_trials(range(100))
except KeyboardInterrupt:
    print('stopped')
"""


def test_ctrl_c_ends_the_reading_processes_without_a_word_of_theirs():
    process = subprocess.Popen(
        [sys.executable, '-c', INTERRUPTED],
        env={**os.environ, 'PYTHONPATH': str(SOURCE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout.readline() == 'reading\n'
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=30)
    assert (out.splitlines()[-1], err) == ('stopped', '')


def test_errors_are_along_the_maps_axes_and_odometry_counts_from_the_start(tmp_path):
    test = load_test('SL', ROOT / 'config').model_dump()
    test['start'] = {'x': 5.0, 'y': 2.0, 'yaw': math.pi / 2}
    test['route'] = [{'goal': {'x': 4.0, 'y': 5.0, 'yaw': math.pi}}]
    about = Trial.from_mapping({'test': test, 'nav': 'embedded'}, '')
    path = write_bag(
        tmp_path / 'a.bag', about, [(0, 0, 0), (3.0, 0.8, 1.6)], [(5.0, 2.0, math.pi / 2), (4.1, 5.3, -3.0)]
    )
    errors = goal_errors(read_trial(path))
    assert errors[PoseSource.AMCL] is None and errors[PoseSource.GLOBAL] is None
    assert errors[PoseSource.ODOM] == pytest.approx([0.2, 0.0, 1.6 - math.pi / 2])
    assert errors[PoseSource.WORLD] == pytest.approx([0.1, 0.3, math.pi - 3.0])


def test_other_configurations_are_kept_apart(tmp_path):
    write_bag(tmp_path / 'a.bag', trial())
    write_bag(tmp_path / 'b.bag', trial(nav='embedded'))
    dataset = load_dataset([tmp_path])
    assert [trial.varied for trial in dataset.trials] == [(('nav', 'scripted'),), (('nav', 'embedded'),)]
    assert dataset.notes == [
        f'{tmp_path}/a.bag and others: nav is embedded or scripted; trials with different values are not pooled'
    ]
