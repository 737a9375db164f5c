"""The likelihood fields against their formulas in plain Python."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.likelihood_field import LikelihoodField
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from laser_model_cases import (
    LASER_POSE,
    RANGE_LIMIT_M,
    brute_force_distances,
    params,
    particles_in_room,
    reference_rays,
    scan_with_gaps,
    turned_room,
)


def test_unknown_cells_are_no_obstacles_in_the_field():
    cells = np.full((9, 9), UNKNOWN, dtype=np.int8)
    cells[4, 4] = OCCUPIED
    field = LikelihoodField(params(), OccupancyGrid(cells, 0.1, Pose2D(0, 0, 0)))
    assert field._distances_m[field._cells[5, 1]] == pytest.approx(0.4)  # with its border: cell (4, 0)


def reference_field(grid, distances, scan, particle, step):
    """Distance from each returned ray's end to the nearest obstacle."""
    for range_m, direction, x, y in reference_rays(grid, scan, particle, step):
        if math.isnan(range_m) or range_m <= scan.range_min_m or range_m >= RANGE_LIMIT_M:
            continue
        row, column = grid.cell_at(x + range_m * math.cos(direction), y + range_m * math.sin(direction))
        yield distances[row, column] if grid.contains(row, column) else None


@pytest.mark.parametrize('model', ['likelihood_field', 'likelihood_field_prob'])
def test_field_weights_are_the_formula(model):
    grid, settings = turned_room(), params(laser_model_type=model)
    distances = brute_force_distances(grid.cells == OCCUPIED, grid.resolution_m, 2.0)
    scan = scan_with_gaps(grid, Pose2D(0.3, 0.2, 0.5))
    particles = particles_in_room(60, np.random.default_rng(3))
    laser = laser_model(settings, grid)
    likelihoods = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False)
    step = {'likelihood_field': 4, 'likelihood_field_prob': 4}[model]
    for particle, factor in zip(particles, likelihoods.factors):
        probabilities = [
            0.95 * math.exp(-((2.0 if d is None else d) ** 2) / (2 * 0.2**2)) + 0.05 / RANGE_LIMIT_M
            for d in reference_field(grid, distances, scan, particle, step)
        ]
        assert len(probabilities) < 10
        if model == 'likelihood_field':
            assert factor == pytest.approx(1.0 + sum(p**3 for p in probabilities), rel=1e-9)
        else:
            assert math.log(factor) + likelihoods.log_scale == pytest.approx(
                sum(math.log(p) for p in probabilities), rel=1e-8
            )
