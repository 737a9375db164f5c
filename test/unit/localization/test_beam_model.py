"""The beam model against its formula in plain Python, and its ray casting."""

import math

import numpy as np
import pytest

from amcl_world import RANGE_MAX_M, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.laser_models import cast_ray, laser_model
from diff_encoder_sim.localization.occupancy_grid import FREE
from laser_model_cases import (
    LASER_POSE,
    RANGE_LIMIT_M,
    params,
    particles_in_room,
    reference_rays,
    scan_with_gaps,
    turned_room,
)


def test_beam_weights_are_the_formula():
    grid, settings = turned_room(), params(laser_model_type='beam', laser_lambda_short=0.4)
    scan = scan_with_gaps(grid, Pose2D(0.3, 0.2, 0.5))
    particles = particles_in_room(40, np.random.default_rng(5))
    laser = laser_model(settings, grid)
    factors = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False).factors
    blocked = grid.cells != FREE
    for particle, factor in zip(particles, factors):
        expected = 1.0
        for range_m, direction, x, y in reference_rays(grid, scan, particle, 4):
            if math.isnan(range_m):
                continue
            no_return = range_m <= scan.range_min_m or range_m >= RANGE_LIMIT_M
            measured_m = RANGE_LIMIT_M if no_return else range_m
            end_x, end_y = x + RANGE_LIMIT_M * math.cos(direction), y + RANGE_LIMIT_M * math.sin(direction)
            start, end = (Pose2D(*point, 0.0).relative_to(grid.origin) for point in ((x, y), (end_x, end_y)))
            cast_m = 0.05 * cast_ray(
                blocked, start.x_m / 0.05, start.y_m / 0.05, end.x_m / 0.05, end.y_m / 0.05, RANGE_LIMIT_M / 0.05
            )
            p = 0.95 * math.exp(-((measured_m - cast_m) ** 2) / (2 * 0.2**2))
            p += 0.1 * 0.4 * math.exp(-0.4 * measured_m) if measured_m < cast_m else 0.0
            p += 0.05 if no_return else 0.05 / RANGE_LIMIT_M
            expected += p**3
        assert factor == pytest.approx(expected, rel=1e-9)


def test_rays_cast_on_the_grid_are_as_long_as_the_room_says():
    """Within two cells of marching through the map, but for a few that graze a corner.

    Bresenham's line goes from cell centre to cell centre.
    """
    grid, pose = pillar_room(), Pose2D(0.2, -0.4, 0.3)
    scan = simulated_scan(grid, pose, ray_count=90)
    local = pose.relative_to(grid.origin)
    directions = local.yaw_rad + scan.bearings_rad()
    cast = [
        cast_ray(
            grid.cells != FREE,
            local.x_m / 0.05,
            local.y_m / 0.05,
            (local.x_m + RANGE_MAX_M * math.cos(direction)) / 0.05,
            (local.y_m + RANGE_MAX_M * math.sin(direction)) / 0.05,
            1e9,
        )
        for direction in directions
    ]
    assert (np.abs(0.05 * np.array(cast) - scan.ranges_m) < 0.1).mean() > 0.95


def test_a_ray_that_meets_nothing_is_as_long_as_asked():
    free = np.zeros((9, 9), dtype=bool)
    assert cast_ray(free, 4.5, 4.5, 7.5, 4.5, 3.0) == 3.0
    assert cast_ray(free, 4.5, 4.5, 4.5, 4.5, 0.5) == 0.5
    assert cast_ray(free, 4.5, 4.5, 104.5, 4.5, 100.0) == 5.0  # the border ends it
    assert cast_ray(free, 4.5, 4.5, 4.5, -95.5, 100.0) == 5.0
    assert cast_ray(free, -50.0, 4.5, 9.0, 4.5, 59.0) == 1.0  # from off the map: at once
