"""Where the package's files are, what relative paths mean, and the version."""

import re
from pathlib import Path

import pytest

from diff_encoder_sim.base import package_files
from places import ROOT


@pytest.mark.parametrize(
    ('share', 'module'),
    [
        ('share/diff_encoder_sim', 'lib/python3/dist-packages/diff_encoder_sim/base/paths.py'),  # of catkin
        ('diff_encoder_sim/share', 'diff_encoder_sim/base/paths.py'),  # of pip
    ],
)
def test_checkout_and_installations_are_found_by_their_configuration(share, module, tmp_path, monkeypatch):
    assert package_files.package_folder().samefile(ROOT)
    (tmp_path / share / 'config').mkdir(parents=True)
    (tmp_path / share / 'config' / 'config.yaml').write_text('')
    monkeypatch.setattr(package_files, '__file__', str(tmp_path / module))
    assert package_files.package_folder() == tmp_path / share


@pytest.mark.parametrize(('given', 'expected'), [('bags/a.bag', '/home/user/bags/a.bag'), ('/tmp/a.bag', '/tmp/a.bag')])
def test_relative_paths_begin_where_the_user_typed_the_command(given, expected, monkeypatch):
    monkeypatch.setenv('PWD', '/home/user')
    assert package_files.users_path(given) == Path(expected)


def test_the_newest_release_in_the_changelog_is_this_version():
    changes = (ROOT / 'CHANGELOG.rst').read_text()
    newest = re.search(r'^(\d+\.\d+\.\d+) \(\d{4}-\d\d-\d\d\)\n-+$', changes, re.MULTILINE)[1]
    assert newest == package_files.package_version()
