"""Reading of recorded drives with their references, as calibrate does."""

import numpy as np
import pytest

from diff_encoder_sim.api.options import SourceOptions
from diff_encoder_sim.api.recorded_sources import read_recorded
from diff_encoder_sim.base.errors import ConfigError
from reencoding_drives import START_NS, angles_rad, drive, true_poses, write

CAMERA = {'reference_columns': ('t', 'x', 'y')}


def camera(tmp_path, first_s=5.0):
    path = tmp_path / 'camera.csv'
    poses = enumerate(true_poses(angles_rad(501))[::5])
    path.write_text('\n'.join(['t,x,y', *(f'{first_s + 0.05 * row},{pose.x_m},{pose.y_m}' for row, pose in poses)]))
    return path


@pytest.mark.parametrize('is_table', [True, False])
def test_the_reference_may_be_a_table_of_its_own(tmp_path, is_table):
    options = SourceOptions(**CAMERA, columns=('1', '2', '3'), unit='rad') if is_table else SourceOptions(**CAMERA)
    path = tmp_path / 'a.csv'
    if is_table:
        rows = [f'{5.0 + 0.01 * index},{left},{right}' for index, (left, right) in enumerate(angles_rad(501).tolist())]
        path.write_text('\n'.join(rows))
    else:
        path = write(tmp_path / 'a.bag', drive())  # its /world_pose is not used
    read = read_recorded(options, path, is_table, camera(tmp_path))
    [(wheels, reference)] = read.parts
    assert (reference.name, read.ppr) == ('camera.csv', None)
    assert (wheels.stamps_ns[0], len(reference.stamps_ns)) == (START_NS, 101)
    assert np.isnan(reference.poses[:, 2]).all() and wheels.wheel_angles_rad == pytest.approx(angles_rad(501))


def test_a_bag_whose_stamps_go_back_has_parts(tmp_path):
    read = read_recorded(SourceOptions(), write(tmp_path / 'a.bag', drive() + drive()), is_table=False)
    assert [(len(wheels), len(reference.stamps_ns)) for wheels, reference in read.parts] == [(501, 101)] * 2


@pytest.mark.parametrize(
    ('rows', 'options', 'first_s', 'text'),
    [
        (drive(reference=None), {}, None, 'no reference; expected --reference TOPIC'),
        (drive(), CAMERA, 1000.0, 'camera.csv is at 1000.000 to 1005.000 s, the wheels at 5.000 to 10.000 s'),
        (drive()[:2], {}, None, 'expected two samples or more'),
        (drive(), {'reference_columns': ('t', 'x', 'z')}, 5.0, '--reference-columns: given z; allowed: a number from'),
    ],
)
def test_a_drive_without_a_usable_reference_is_refused(tmp_path, rows, options, first_s, text):
    table = None if first_s is None else camera(tmp_path, first_s)
    with pytest.raises(ConfigError, match=text):
        read_recorded(SourceOptions(**options), write(tmp_path / 'a.bag', rows), False, table)
