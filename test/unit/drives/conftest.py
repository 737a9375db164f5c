"""What the tests of serialization share."""

import numpy as np
import pytest


@pytest.fixture(name='rng', params=range(2))
def fixture_rng(request):
    return np.random.default_rng(request.param)
