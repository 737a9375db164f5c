"""Where the package's files are, what relative paths mean, and the version."""

import re
from importlib import metadata
from pathlib import Path
from xml.etree import ElementTree

import pytest

from diff_encoder_sim.base import package_files as paths
from diff_encoder_sim.base import package_files as version
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


@pytest.mark.parametrize(('given', 'expected'), [('bags/a.bag', '/home/user/bags/a.bag'), ('/tmp/a.bag', '/tmp/a.bag')])
def test_relative_paths_begin_where_the_user_typed_the_command(given, expected, monkeypatch):
    monkeypatch.setenv('PWD', '/home/user')
    assert paths.users_path(given) == Path(expected)


def no_package_folder():
    raise ConfigError('config/config.yaml: not found')


def test_the_version_is_that_of_package_xml():
    written = ElementTree.parse(ROOT / 'package.xml').findtext('version')
    assert version.package_version() == written and re.fullmatch(r'\d+\.\d+\.\d+', written)


def test_the_newest_release_in_the_changelog_is_this_version():
    headings = re.findall(
        r'^(\d+\.\d+\.\d+) \(\d{4}-\d\d-\d\d\)\n-+$', (ROOT / 'CHANGELOG.rst').read_text(), re.MULTILINE
    )
    assert headings[0] == version.package_version()


def test_an_installation_by_pip_takes_the_version_from_its_metadata(monkeypatch):
    monkeypatch.setattr(version, 'package_folder', no_package_folder)
    monkeypatch.setattr(version.metadata, 'version', {'diff_encoder_sim': '9.8.7'}.__getitem__)
    assert version.package_version() == '9.8.7'


def test_where_nothing_has_the_version_it_is_unknown(monkeypatch):
    def not_found(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(version, 'package_folder', no_package_folder)
    monkeypatch.setattr(version.metadata, 'version', not_found)
    assert version.package_version() == 'unknown'
