"""Errors of reencoded drives, with and without a reference, and drives that end or jump."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import angles_rad, drive, true_poses, without_index, write_ros1
from reencoding_runs import rows_of, run, samples_of

PPRS = (40, 90, 1024)


@pytest.fixture
def bag(tmp_path):
    return write_ros1(tmp_path / 'drive.bag', drive())


def test_errors_are_those_of_the_odometry(tmp_path, bag, capsys):
    run(bag, '--ppr', *PPRS, '--out', tmp_path / 'out')
    truth = true_poses(angles_rad(501))[::5]
    for ppr, row in zip(PPRS, rows_of(tmp_path / 'out')):
        odometry = WheelOdometry(OdometryParams(ppr=ppr))
        poses = [odometry.update(*sample).base_pose_in_odom for sample in samples_of(angles_rad(501), ppr)]
        offsets = np.array([(pose.x_m - true.x_m, pose.y_m - true.y_m) for pose, true in zip(poses, truth)])
        assert (row['ppr'], row['common_stamps'], row['reports']) == (str(ppr), '101', '101')
        assert float(row['ate_rmse_m']) == pytest.approx(math.sqrt((offsets**2).sum(axis=1).mean()), abs=1e-12)
        assert [float(row['end_x_m']), float(row['end_y_m'])] == pytest.approx(offsets[-1].tolist(), abs=1e-12)
        assert '{:.4f}'.format(float(row['ate_rmse_m'])) in capsys.readouterr().out or ppr != PPRS[0]


def test_without_a_reference_the_finest_is_one(tmp_path, capsys):
    run(write_ros1(tmp_path / 'a.bag', drive(reference=None)), '--ppr', '4096', '40', '--out', tmp_path / 'out')
    finest, coarse = rows_of(tmp_path / 'out')
    assert finest['ate_rmse_m'] == '' and 0.0 < float(coarse['ate_rmse_m']) < 0.05
    assert 'compared with the odometry of the finest PPR' in capsys.readouterr().out


def test_a_crashed_bag_is_read_as_far_as_it_goes(tmp_path, bag, capsys):
    torn = tmp_path / 'torn.bag.active'
    torn.write_bytes(without_index(bag.read_bytes())[:-20_000])
    run(torn, '--ppr', '90', '--out', tmp_path / 'out')
    (row,) = rows_of(tmp_path / 'out')
    assert 50 < int(row['reports']) < 101
    assert 'torn.bag.active: ' in capsys.readouterr().err


def test_time_that_goes_back_is_told_once(tmp_path, capsys, caplog):
    rows = drive(count=301)
    path = write_ros1(tmp_path / 'a.bag', rows + rows)
    run(path, '--ppr', '90', '40', '--out', tmp_path / 'out')
    assert any('joint stamps went back' in record.getMessage() for record in caplog.records)
    assert all(int(row['reports']) == 122 for row in rows_of(tmp_path / 'out'))
    assert all(float(row['ate_max_m']) < 0.05 for row in rows_of(tmp_path / 'out'))
