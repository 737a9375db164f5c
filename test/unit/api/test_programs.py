"""Recorded drives as arrays, and campaigns, from a program; test/test_notebooks.py runs a campaign."""

import csv
import shutil

import numpy as np
import pytest

from diff_encoder_sim import api
from places import ROOT
from trial_bags import trial, write_bag

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


def test_bags_are_read_and_reported(tmp_path):
    results = api.read_results(write_bag(tmp_path / 'a.bag', trial()))
    (only,) = results.trials.itertuples()
    assert (only.test, only.ppr) == ('SL', '40') and only.world_y_m == pytest.approx(0.1)
    assert 'SL' in api.summary(results)
    report = api.write_report(results, tmp_path / 'report')
    assert report == tmp_path / 'report' / 'report.html' and report.is_file()


@pytest.mark.parametrize(
    ('options', 'named'),
    [
        ({'config': 'none'}, 'none'),
        ({'trials': 0}, 'trials'),
        ({'amcl': 'nothing'}, "files.amcl: given 'nothing'; allowed: amcl"),
        ({'amcl': 'navigation'}, 'navigation.yaml: base_global_planner: unknown key'),
    ],
)
def test_a_mistake_is_an_error_of_one_line_and_leaves_nothing(options, named, tmp_path):
    with pytest.raises(api.ConfigError) as error:
        api.run_campaign(tmp_path / 'results', **options)
    assert named in str(error.value) and '\n' not in str(error.value)
    assert not (tmp_path / 'results').exists()
