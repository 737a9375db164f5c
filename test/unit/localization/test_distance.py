"""The distance transform against brute force."""

import numpy as np
import pytest

from diff_encoder_sim.localization.likelihood_field import distance_field
from laser_model_cases import brute_force_distances


@pytest.mark.parametrize(
    ('shape', 'fraction'),
    [
        ((1, 1), 1.0),
        ((1, 1), 0.0),
        ((1, 40), 0.1),
        ((40, 1), 0.1),
        ((17, 31), 0.0),
        ((17, 31), 1.0),
        ((30, 23), 0.003),
        ((23, 30), 0.02),
        ((30, 30), 0.3),
    ],
)
def test_distances_are_exact(shape, fraction):
    for seed in range(5):
        occupied = np.random.default_rng(seed).random(shape) < fraction
        for limit_m in (0.3, 100.0):
            field = distance_field(occupied, 0.05, limit_m)
            assert field.distances_m[field.indices] == pytest.approx(
                brute_force_distances(occupied, 0.05, limit_m), rel=1e-12
            )
            assert field.distances_m[-1] == limit_m
