"""The package's own folder, and paths as a user gives them."""

import pytest

from diff_encoder_sim.base import paths
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder, users_path
from places import ROOT


def test_in_a_checkout_the_package_folder_is_its_root():
    assert package_folder() == ROOT


@pytest.mark.parametrize('module', ['src/diff_encoder_sim/base', 'lib/python3/dist-packages/diff_encoder_sim/base'])
@pytest.mark.parametrize('config', ['config', 'share/diff_encoder_sim/config'])
def test_the_package_folder_is_found_above_the_module(tmp_path, monkeypatch, module, config):
    (tmp_path / config).mkdir(parents=True)
    (tmp_path / config / 'config.yaml').touch()
    monkeypatch.setattr(paths, '__file__', str(tmp_path / module / 'paths.py'))
    assert package_folder() == (tmp_path / config).parent


def test_a_package_without_its_files_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(paths, '__file__', str(tmp_path / 'paths.py'))
    with pytest.raises(ConfigError, match=r'config/config\.yaml: not found above'):
        package_folder()


def test_relative_paths_are_those_of_the_users_shell(tmp_path, monkeypatch):
    monkeypatch.setenv('PWD', str(tmp_path))
    assert users_path('a/../b.bag') == tmp_path / 'b.bag'
    assert users_path('/c.bag').as_posix() == '/c.bag'
