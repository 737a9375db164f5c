"""The files that reencode writes: their names, and those that are there already."""

import pytest

from diff_encoder_sim.api.recorded_drives import output_files
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode import parse
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, chosen, load_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel
from places import CONFIG

NINETY = ChosenEncoder(PerWheel(left=90, right=90))


def test_files_are_named_by_bag_and_encoder(tmp_path):
    real = chosen(load_encoder('amt102', CONFIG, tmp_path))
    encoders = [NINETY, ChosenEncoder(PerWheel(left=40, right=1024)), real]
    files = output_files(tmp_path, tmp_path / 'drive.bag', encoders)
    names = ['drive_90ppr.bag', 'drive_40-1024ppr.bag', 'drive_8192_amt102.bag', 'reencode.csv']
    assert [path.name for path in files.values()] == names
    assert output_files(None, tmp_path / 'drive.bag', [NINETY]) == {}


def test_the_working_folder_as_a_bag_of_ros_2_gives_files_its_name(tmp_path, monkeypatch):
    (tmp_path / 'drive').mkdir()
    monkeypatch.chdir(tmp_path / 'drive')
    assert output_files(tmp_path, parse(['.']).bag, [NINETY])['90'].name == 'drive_90ppr.bag'


def test_files_that_exist_are_not_overwritten(tmp_path):
    (tmp_path / 'reencode.csv').write_text('precious')
    with pytest.raises(ConfigError, match=r'--out: .*/reencode\.csv exists'):
        output_files(tmp_path, tmp_path / 'drive.bag', [NINETY])
