"""How particle sets are drawn and measured; refusing bad input is tested with the filter (test_amcl_input.py)."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import (
    even_normals,
    has_converged,
    particles_around,
    particles_everywhere,
    weight_near,
)


def test_particles_around_a_pose_have_its_mean_and_covariance():
    covariance = np.array([[0.09, 0.05, 0.0], [0.05, 0.04, 0.0], [0.0, 0.0, 0.01]])
    particles = particles_around(Pose2D(1.0, -2.0, 0.3), covariance, 100_000, np.random.default_rng(0))
    assert particles.mean(axis=0) == pytest.approx([1.0, -2.0, 0.3], abs=0.005)
    assert np.cov(particles.T) == pytest.approx(covariance, abs=0.001)


def test_normal_draws_are_spread_evenly():
    """Their mean and variance are nearer to 0 and 1 than those of independent draws: by 1 / sqrt(n), sqrt(2 / n)."""
    for seed in range(5):
        normals = even_normals(3000, np.random.default_rng(seed))
        assert normals.mean(axis=0) == pytest.approx([0.0] * 3, abs=0.3 / math.sqrt(3000))
        assert np.cov(normals.T) == pytest.approx(np.eye(3), abs=0.9 / math.sqrt(3000))
    assert np.isfinite(even_normals(1, np.random.default_rng(0))).all()


def test_headings_of_particles_are_wrapped():
    particles = particles_around(Pose2D(0.0, 0.0, math.pi), np.diag([0.0, 0.0, 0.01]), 1000, np.random.default_rng(0))
    assert ((particles[:, 2] >= -math.pi) & (particles[:, 2] < math.pi)).all()
    assert (particles[:, 2] < 0.0).mean() == pytest.approx(0.5, abs=0.1)
    assert (particles[:, :2] == 0.0).all()


def test_particles_everywhere_are_on_the_free_cells_with_any_heading():
    grid = OccupancyGrid(np.array([[FREE, OCCUPIED], [UNKNOWN, FREE]], np.int8), 2.0, IDENTITY)
    particles = particles_everywhere(FreeCells(grid), 10_000, np.random.default_rng(0))
    assert {tuple(position) for position in particles[:, :2].tolist()} == {(1.0, 1.0), (3.0, 3.0)}
    assert particles[:, 2].std() == pytest.approx(2 * math.pi / math.sqrt(12), rel=0.03)


def test_a_set_has_converged_when_none_is_farther_than_half_a_metre_from_the_mean():
    pair = np.array([[-0.5, 0.0, 1.0], [0.5, 0.0, -2.0]])
    assert has_converged(pair)
    assert not has_converged(pair * [1.01, 1.0, 1.0])


def test_the_weight_near_a_pose_counts_along_x_and_y():
    particles = np.array([[0.0, 0.0, 0.0], [0.4, 0.4, 3.0], [0.6, 0.0, 0.0]])
    assert weight_near(particles, np.array([0.5, 0.3, 0.2]), Pose2D(0.0, 0.0, 1.0), 0.5) == pytest.approx(0.8)
