"""The version is written in package.xml; the changelog and an installation without that file agree with it."""

import re
from importlib import metadata
from xml.etree import ElementTree

from diff_encoder_sim.base import package_files as version
from diff_encoder_sim.base.errors import ConfigError
from places import ROOT


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
