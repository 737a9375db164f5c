"""What tests of navigation share."""

import pytest

from navigation_simulation import walled_room


@pytest.fixture(name='room', scope='module')
def fixture_room():
    return walled_room()
