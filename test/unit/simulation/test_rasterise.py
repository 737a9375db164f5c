"""Maps drawn from world files."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from diff_encoder_sim.simulation.rasterise import rasterise, surface_points
from diff_encoder_sim.simulation.world import load_world
from grid_cells import cell_centre
from places import WORLDS


@pytest.mark.parametrize(('name', 'free'), [('hallway', (-10.0, 0.0)), ('ros_logo', (-3.4, -0.85))])
def test_a_rasterised_world_has_its_surfaces_and_nothing_else(name, free):
    world = load_world(WORLDS / f'{name}.world')
    grid = rasterise(world, 1.12, 0.05, *free)
    points_m = surface_points(world, 1.12, 0.01)
    occupied_m = np.array([cell_centre(grid, row, column) for row, column in np.argwhere(grid.cells == OCCUPIED)])
    nearest_m = np.array([np.hypot(*(points_m - centre).T).min() for centre in occupied_m])
    assert nearest_m.max() < 0.05 * math.sqrt(0.5) + 0.01  # a surface runs through the cell
    assert grid.cells[grid.cell_at(*free)] == FREE
    assert (grid.cells[[0, -1]] == UNKNOWN).all() and (grid.cells[:, [0, -1]] == UNKNOWN).all()


def test_the_hallways_walls_are_drawn_alike_on_both_sides():
    grid = rasterise(load_world(WORLDS / 'hallway.world'), 1.12, 0.05, -10.0, 0.0)
    y_m = np.array([cell_centre(grid, row, 0)[1] for row in range(grid.height)])
    occupied = (grid.cells == OCCUPIED).sum(axis=1)
    for wall_m in (3.0, -3.0):
        assert occupied[np.argmin(np.abs(y_m - wall_m))] > 200
        assert np.abs(y_m - wall_m).min() < 1e-6


def test_a_free_point_in_a_wall_or_outside_is_refused():
    world = load_world(WORLDS / 'hallway.world')
    for point in ((16.1, 0.0), (500.0, 0.0)):
        with pytest.raises(ConfigError, match=rf'free point \({point[0]}, 0.0\)'):
            rasterise(world, 1.12, 0.05, *point)
    with pytest.raises(ConfigError, match='nothing to map'):
        rasterise(world, 30.0, 0.05, 0.0, 0.0)
    with pytest.raises(ConfigError, match=r'resolution 0\.001 m: a map of .* cells; allowed: at most'):
        rasterise(world, 1.12, 0.001, 0.0, 0.0)
