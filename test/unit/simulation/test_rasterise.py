"""Maps drawn from world files, and the shipped maps, which must be true to their worlds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import IDENTITY, move_along_arc
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from diff_encoder_sim.simulation.rasterise import rasterise, surface_points
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from grid_cells import cell_centre
from map_accuracy import map_accuracy, true_surface, visible_points
from places import ROOT, WORLDS

SCAN_HEIGHT_M, RANGE_M, NEAR_M = 1.12, 5.9, 0.05
BEARINGS_RAD = np.linspace(-math.pi, math.pi, 720, endpoint=False)


@pytest.mark.parametrize(('name', 'free'), [('hallway', (-10.0, 0.0)), ('ros_logo', (-3.4, -0.85))])
def test_a_rasterised_world_has_its_surfaces_and_nothing_else(name, free):
    world = load_world(WORLDS / f'{name}.world')
    grid = rasterise(world, SCAN_HEIGHT_M, 0.05, *free)
    points_m = surface_points(world, SCAN_HEIGHT_M, 0.01)
    occupied_m = np.array([cell_centre(grid, row, column) for row, column in np.argwhere(grid.cells == OCCUPIED)])
    nearest_m = np.array([np.hypot(*(points_m - centre).T).min() for centre in occupied_m])
    assert nearest_m.max() < 0.05 * math.sqrt(0.5) + 0.01  # a surface runs through the cell
    assert grid.cells[grid.cell_at(*free)] == FREE
    assert (grid.cells[[0, -1]] == UNKNOWN).all() and (grid.cells[:, [0, -1]] == UNKNOWN).all()
    if name == 'hallway':  # its walls are drawn alike on both sides
        y_m = np.array([cell_centre(grid, row, 0)[1] for row in range(grid.height)])
        occupied = (grid.cells == OCCUPIED).sum(axis=1)
        for wall_m in (3.0, -3.0):
            row = np.argmin(np.abs(y_m - wall_m))
            assert occupied[row] > 200 and abs(y_m[row] - wall_m) < 1e-6


@pytest.mark.parametrize(
    ('arguments', 'expected'),
    [
        ((1.12, 0.05, 16.1, 0.0), r'free point \(16.1, 0.0\): in a wall'),
        ((1.12, 0.05, 500.0, 0.0), r'free point \(500.0, 0.0\): outside'),
        ((30.0, 0.05, 0.0, 0.0), 'nothing to map'),
        ((1.12, 0.001, 0.0, 0.0), r'resolution 0\.001 m: a map of .* cells; allowed: at most'),
    ],
)
def test_a_map_that_cannot_be_drawn_is_refused(arguments, expected):
    with pytest.raises(ConfigError, match=expected):
        rasterise(load_world(WORLDS / 'hallway.world'), *arguments)


def tour(name):
    """Where the robot came by, each half second."""
    test = load_params(TestDefinition, ROOT / 'config' / 'mapping' / f'{name}.yaml')
    drive, poses = ScriptedDrive(test), [test.start.pose()]
    for step in range(int(2.0 * drive.duration_s)):
        linear, angular = drive.command_at(0.5 * step, 0.5)
        poses.append(move_along_arc(poses[-1], 0.5 * linear, 0.5 * angular))
    return poses


@pytest.mark.parametrize('name', ['hallway', 'ros_logo'])
def test_a_shipped_map_is_true_to_its_world(name):
    world, poses = load_world(WORLDS / f'{name}.world'), tour(name)
    surface = true_surface(world, SCAN_HEIGHT_M, poses[0].x_m, poses[0].y_m)
    visible = visible_points(world, SCAN_HEIGHT_M, surface, poses[::2], BEARINGS_RAD, RANGE_M)
    accuracy = map_accuracy(load_map(WORLDS / f'{name}.yaml'), IDENTITY, surface, visible, NEAR_M)
    assert accuracy.correct_fraction >= 0.99 and accuracy.mapped_fraction >= 0.97
