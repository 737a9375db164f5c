"""One scan of a laser."""

import numpy as np
import pytest

from diff_encoder_sim.base.laser_scan import Scan


def test_bearings_begin_at_the_first_ray():
    scan = Scan(0, -1.0, 0.5, 0.1, 6.0, np.ones(5))
    assert scan.bearings_rad() == pytest.approx([-1.0, -0.5, 0.0, 0.5, 1.0])
