"""Maps of the shipped worlds against their geometry, from simulated drives."""

import numpy as np
import pytest

from patch_memory import patch_count, unshared_patch_count
from slam_drives import HALLWAY, ROS_LOGO, Case

PARTICLES = 6


@pytest.fixture(scope='session', params=[HALLWAY, ROS_LOGO], ids=lambda tour: tour.world)
def case(request):
    return Case(request.param, pprs=(40,))


@pytest.mark.heavy
def test_the_map_of_ideal_odometry(case):
    accuracy, error, _, _, bias_m = case.map('ideal', 'fine', particles=PARTICLES)
    assert accuracy.correct_fraction >= 0.99
    assert accuracy.mapped_fraction >= 0.97
    assert error.ate_rmse_m < 0.015
    assert np.abs(bias_m).max() < 0.003


@pytest.mark.heavy
def test_the_map_of_a_coarse_encoder(case):
    """40 PPR and 3 cm of noise: odometry alone ends decimetres off."""
    accuracy, error, slam, _, _ = case.map('40', 'coarse', particles=PARTICLES)
    assert accuracy.correct_fraction >= 0.98
    assert accuracy.mapped_fraction >= 0.97
    assert error.ate_rmse_m < 0.05
    # Of the ROS-logo world each scan sees most patches, so there its particles have little in common.
    most = {'hallway': 0.85, 'ros_logo': 0.95}[case.drive.world.name]
    assert patch_count(slam.maps) < most * unshared_patch_count(slam.maps)
