"""The potential of the global planner."""

import math

import numpy as np
import pytest

from diff_encoder_sim.navigation.global_planner import propagate


def test_potential_is_the_fixpoint_of_the_wave_equation():
    """Sweeping the eikonal update over all cells until nothing changes gives the same."""
    random = np.random.default_rng(3)
    weights = random.uniform(50.0, 250.0, (25, 30))
    weights[random.random(weights.shape) < 0.2] = np.inf
    weights[12, 15] = 50.0
    expected = np.full((27, 32), np.inf)
    expected[13, 16] = 0.0
    for _ in range(200):
        for row in range(1, 26):
            for column in range(1, 31):
                weight = weights[row - 1, column - 1]
                along = min(expected[row, column - 1], expected[row, column + 1])
                across = min(expected[row - 1, column], expected[row + 1, column])
                low, high = min(along, across), max(along, across)
                if np.isfinite(low) and np.isfinite(weight):
                    apart = high - low
                    new = low + weight if apart >= weight else low + 0.5 * (apart + math.sqrt(2 * weight**2 - apart**2))
                    expected[row, column] = min(expected[row, column], new)
    potential = propagate(weights, 12, 15, 0, 0, 50.0, False, False)
    assert potential == pytest.approx(expected[1:-1, 1:-1])
