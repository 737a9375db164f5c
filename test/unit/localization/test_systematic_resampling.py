"""Weights, their entropy, and which particles are kept."""

import math

import numpy as np
import pytest

from diff_encoder_sim.localization.slam_params import entropy_of, normalised, systematic_indices


def test_systematic_resampling_keeps_proportions():
    weights = np.array([0.05, 0.5, 0.0, 0.25, 0.2])
    counts = np.zeros(5)
    for seed in range(2000):
        indices = systematic_indices(weights, np.random.default_rng(seed))
        assert (np.diff(indices) >= 0).all()
        drawn = np.bincount(indices, minlength=5)
        assert (np.abs(drawn - 5 * weights) < 1.0).all()
        counts += drawn
    assert counts / 10_000 == pytest.approx(weights, abs=0.005)


def test_weights_from_logs_and_their_entropy():
    assert normalised(np.array([-1e6, -1e6])) == pytest.approx([0.5, 0.5])
    assert entropy_of(np.full(30, 1 / 30)) == pytest.approx(math.log(30))
    assert entropy_of(np.array([1.0, 0.0])) == 0.0
