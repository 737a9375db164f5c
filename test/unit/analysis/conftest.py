"""A campaign's results that several tests analyse."""

import shutil

import pytest

from analysed_campaigns import finish
from campaign_files import small_campaign


@pytest.fixture(name='finished', scope='session')
def fixture_finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp('campaign')
    return finish(small_campaign(folder), folder / 'out')


@pytest.fixture(name='folder')
def fixture_folder(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / 'out')
