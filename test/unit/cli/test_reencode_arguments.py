"""Encoders and output files as reencode's command line gives them."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_arguments import output_files, parse, ppr_of_text, pprs_of_texts
from diff_encoder_sim.encoders.pulses import PerWheel


def test_pprs_keep_their_order():
    both, each = PerWheel(left=4096, right=4096), PerWheel(left=40, right=90.5)
    assert pprs_of_texts(['4096', '{left: 40, right: 90.5}']) == [both, each]


def test_a_ppr_given_twice_is_refused():
    with pytest.raises(ConfigError, match='--ppr: given 90 twice'):
        pprs_of_texts(['90', '90.0'])


@pytest.mark.parametrize('text', ['0', 'many', '{left: 40', '[40]'])
def test_what_is_no_ppr_is_refused_by_its_option(text):
    with pytest.raises(ConfigError, match='^--pulses-ppr: ppr'):
        ppr_of_text('--pulses-ppr', text)


def test_files_are_named_by_bag_and_ppr(tmp_path):
    files = output_files(tmp_path, tmp_path / 'drive.bag', pprs_of_texts(['90', '{left: 40, right: 1024}']))
    assert [path.name for path in files.values()] == ['drive_90ppr.bag', 'drive_40-1024ppr.bag', 'reencode.csv']
    assert output_files(None, tmp_path / 'drive.bag', pprs_of_texts(['90'])) == {}


def test_the_working_folder_as_a_bag_of_ros_2_gives_files_its_name(tmp_path, monkeypatch):
    (tmp_path / 'drive').mkdir()
    monkeypatch.chdir(tmp_path / 'drive')
    assert output_files(tmp_path, parse(['.']).bag, pprs_of_texts(['90']))['90'].name == 'drive_90ppr.bag'


def test_files_that_exist_are_not_overwritten(tmp_path):
    (tmp_path / 'reencode.csv').write_text('precious')
    with pytest.raises(ConfigError, match=r'--out: .*/reencode\.csv exists'):
        output_files(tmp_path, tmp_path / 'drive.bag', pprs_of_texts(['90']))
