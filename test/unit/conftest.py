"""What unit tests share."""

import logging

import pytest
from hypothesis import settings

# The same examples are drawn in every run: a failure here is a failure everywhere.
settings.register_profile('repeatable', derandomize=True, deadline=None)
settings.load_profile('repeatable')


@pytest.fixture(autouse=True)
def fixture_loggers():
    """Enable the loggers that rospy disables if a node ran in this process before."""
    for name, logger in logging.root.manager.loggerDict.items():
        if name.startswith('diff_encoder_sim') and isinstance(logger, logging.Logger):
            logger.disabled, logger.propagate = False, True
            logger.setLevel(logging.NOTSET)
    logging.disable(logging.NOTSET)
    logging.getLogger().setLevel(logging.WARNING)


@pytest.fixture(name='campaign', scope='module')
def fixture_campaign(tmp_path_factory):
    """SL at two noises of the LiDAR, two PPR and two trials each."""
    from campaign_files import TWO_NOISES, small_campaign  # here: other tests do without its imports

    return small_campaign(tmp_path_factory.mktemp('campaign'), **TWO_NOISES)


@pytest.fixture(name='whole')
def fixture_whole(campaign, tmp_path):
    """The table of that campaign when nothing has disturbed it."""
    from campaign_files import run

    return run(campaign, tmp_path / 'whole')
