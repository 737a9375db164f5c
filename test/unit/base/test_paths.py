"""Where the package's files are, and what the user's relative paths mean."""

from pathlib import Path

import pytest

from diff_encoder_sim.base import package_files as paths
from diff_encoder_sim.base.errors import ConfigError
from places import ROOT


def test_the_checkout_is_found_by_its_configuration():
    assert paths.package_folder().samefile(ROOT)


def test_an_installation_is_found_in_share(tmp_path, monkeypatch):
    share = tmp_path / 'share' / 'diff_encoder_sim'
    (share / 'config').mkdir(parents=True)
    (share / 'config' / 'config.yaml').write_text('')
    module = tmp_path / 'lib' / 'python3' / 'dist-packages' / 'diff_encoder_sim' / 'base' / 'paths.py'
    monkeypatch.setattr(paths, '__file__', str(module))
    assert paths.package_folder() == share


def test_an_installation_by_pip_is_found_in_the_package(tmp_path, monkeypatch):
    package = tmp_path / 'lib' / 'python3.8' / 'site-packages' / 'diff_encoder_sim'
    (package / 'share' / 'config').mkdir(parents=True)
    (package / 'share' / 'config' / 'config.yaml').write_text('')
    monkeypatch.setattr(paths, '__file__', str(package / 'base' / 'paths.py'))
    assert paths.package_folder() == package / 'share'


def test_a_copy_without_configuration_says_what_is_missing(tmp_path, monkeypatch):
    monkeypatch.setattr(paths, '__file__', str(tmp_path / 'paths.py'))
    with pytest.raises(ConfigError, match=r'config/config\.yaml: not found'):
        paths.package_folder()


@pytest.mark.parametrize(('given', 'expected'), [('bags/a.bag', '/home/user/bags/a.bag'), ('/tmp/a.bag', '/tmp/a.bag')])
def test_relative_paths_begin_where_the_user_typed_the_command(given, expected, monkeypatch):
    monkeypatch.setenv('PWD', '/home/user')
    assert paths.users_path(given) == Path(expected)
