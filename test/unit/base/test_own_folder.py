"""A folder that nobody else can write into, although /tmp is everybody's."""

import os
import tempfile

import pytest

from diff_encoder_sim.base.own_folder import own_folder


@pytest.fixture
def places(tmp_path, monkeypatch):
    """The user's cache, which cannot be made, and /tmp."""
    (tmp_path / 'home').write_text('HOME is no folder: nothing can be made below it')
    (tmp_path / 'tmp').mkdir()
    monkeypatch.setenv('HOME', str(tmp_path / 'home'))
    monkeypatch.delenv('XDG_CACHE_HOME', raising=False)
    monkeypatch.setattr(tempfile, 'tempdir', str(tmp_path / 'tmp'))
    return tmp_path


def in_tmp(places):
    return places / 'tmp' / f'diff_encoder_sim-{os.geteuid()}'


def test_the_users_cache_comes_first(places, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(places / 'cache'))
    assert own_folder() == places / 'cache' / 'diff_encoder_sim'


@pytest.mark.parametrize('home', ['as it is', 'none', 'relative'])
def test_without_a_home_it_is_in_tmp_and_for_this_user_alone(places, monkeypatch, home):
    if home == 'relative':
        monkeypatch.setenv('HOME', 'somewhere')
    elif home == 'none':
        monkeypatch.delenv('HOME')
        monkeypatch.setattr(os.path, 'expanduser', lambda path: path)  # as for a number without an account
    assert own_folder() == in_tmp(places)
    assert in_tmp(places).stat().st_mode & 0o777 == 0o700


def test_a_folder_that_others_can_write_is_not_taken(places):
    in_tmp(places).mkdir()
    in_tmp(places).chmod(0o777)
    assert own_folder() is None


def test_a_folder_of_somebody_else_is_not_taken(places, monkeypatch):
    in_tmp(places).mkdir(mode=0o700)
    user = os.geteuid()
    assert own_folder() == in_tmp(places)
    monkeypatch.setattr(os, 'geteuid', lambda: user + 1)
    in_tmp(places).mkdir(mode=0o700)
    assert own_folder() is None


def test_a_link_is_not_followed(places):
    (places / 'elsewhere').mkdir(mode=0o700)
    in_tmp(places).symlink_to(places / 'elsewhere')
    assert own_folder() is None
