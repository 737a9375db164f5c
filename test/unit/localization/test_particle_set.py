"""The particle set between restart and resampling; the draws are tested in test_kld_resampling.py."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Likelihoods
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import ParticleSet

FREE_CELLS = FreeCells(OccupancyGrid(np.zeros((1, 1), np.int8), 1.0, IDENTITY))
TOGETHER = np.zeros((4, 3))
APART = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0], [5.0, 5.0, 0.0]])


def particle_set(particles, **changes):
    params = AmclParams(min_particles=4, max_particles=4, **changes)
    return ParticleSet(params, particles, np.random.default_rng(0))


def test_weights_are_multiplied_by_the_likelihoods():
    found = particle_set(APART)
    found.weigh(Likelihoods(np.array([1.0, 2.0, 3.0, 2.0]), -1000.0))
    found.weigh(Likelihoods(np.array([1.0, 1.0, 0.0, 1.0]), 0.0))
    assert found.weights == pytest.approx([0.2, 0.4, 0.0, 0.4])


def test_a_scan_that_no_particle_explains_makes_the_weights_equal():
    found = particle_set(APART)
    found.weigh(Likelihoods(np.array([1.0, 2.0, 3.0, 4.0]), 0.0))
    before = found.averages.slow
    found.weigh(Likelihoods(np.zeros(4), 0.0))
    assert found.weights == pytest.approx([0.25] * 4)
    assert found.averages.slow == before


def test_particles_that_have_settled_once_stay_settled_until_a_restart():
    found = particle_set(APART)
    assert not found.has_settled
    found.weigh(Likelihoods(np.array([1.0, 0.0, 0.0, 0.0]), 0.0))
    found.resample(FREE_CELLS)
    assert found.has_settled and found.has_converged
    found.move(IDENTITY, Pose2D(50.0, 0.0, 0.0))
    found.resample(FREE_CELLS)
    assert found.has_settled
    found.restart(APART)
    assert not found.has_settled and not found.has_converged
    found.restart(TOGETHER)
    assert found.has_settled and not found.has_converged  # upstream: not before it has resampled
