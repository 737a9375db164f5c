"""Recorded drives as arrays: the numbers are those of the command and of its bags."""

import csv
import shutil

import numpy as np
import pytest

from diff_encoder_sim import api
from places import ROOT

DRIVE = ROOT / 'docs' / 'notebooks' / 'drive.bag'


def test_paths_and_errors_are_those_that_the_command_writes(tmp_path):
    drives = api.reencode(DRIVE, robot='alto', ppr=[40, 1024], out=tmp_path / 'out')
    assert [drive.ppr for drive in drives] == ['40', '1024']
    with (tmp_path / 'out' / 'reencode.csv').open() as file:
        rows = list(csv.DictReader(file))
    for drive, row in zip(drives, rows):
        written = api.read_path(tmp_path / 'out' / f'drive_{drive.ppr}ppr.bag')
        assert np.array_equal(written.stamps_ns, drive.odometry.stamps_ns)
        assert np.allclose(written.x_y_yaw, drive.odometry.x_y_yaw, atol=1e-9)
        assert drive.error.ate_rmse_m == pytest.approx(float(row['ate_rmse_m']))


def test_what_is_not_known_of_the_wheels_is_said(caplog, tmp_path):
    shutil.copy(str(DRIVE), str(tmp_path))
    api.reencode(tmp_path / 'drive.bag', ppr=40)
    assert 'neither the bag nor --robot contains wheel parameters' in caplog.text


def test_a_path_is_of_a_topic_that_there_is():
    truth = api.read_path(DRIVE, '/world_pose')
    assert truth.path_length_m() == pytest.approx(94.8, abs=0.1)
    with pytest.raises(api.ConfigError, match=r'/odom, which is not there; allowed: /world_pose'):
        api.read_path(DRIVE)


def test_an_encoder_that_cannot_be_is_an_error():
    with pytest.raises(api.ConfigError, match='--ppr'):
        api.reencode(DRIVE, ppr=[0])
