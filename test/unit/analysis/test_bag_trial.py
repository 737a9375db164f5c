"""One trial from its bag."""

import math
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from diff_encoder_sim.analysis.bag_dataset import MOST_POINTS
from diff_encoder_sim.analysis.dataset_loading import load_dataset
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from places import SOURCE
from synthetic_trials import ALTO
from trial_bags import TRUTH, trial, write_bag


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
