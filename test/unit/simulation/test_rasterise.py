"""Maps drawn from world files, their accuracy, and the shipped maps, which must be true to their worlds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.robots.description import Box, Cylinder
from diff_encoder_sim.simulation.rasterise import (
    SPACING_M,
    map_accuracy,
    rasterise,
    surface_points,
    true_surface,
    visible_points,
)
from diff_encoder_sim.simulation.world import Model, Solid, World, load_world
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from grid_cells import cell_centre
from places import ROOT, WORLDS


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


CELL_M = 0.1
WALL = np.column_stack([np.arange(0.005, 1.0, 0.01), np.full(100, 0.56)])


def grid_with(*cells, origin=IDENTITY):
    """10 x 10 cells of 0.1 m, those given as (row, column) occupied."""
    grid = OccupancyGrid(np.zeros((10, 10), np.int8), CELL_M, origin)
    for row, column in cells:
        grid.cells[row, column] = 100
    return grid


def test_a_perfect_map():
    accuracy = map_accuracy(grid_with(*((5, c) for c in range(10))), IDENTITY, WALL, WALL, CELL_M)
    assert accuracy == (10, 1.0, 1.0, 1.0)


def test_each_cell_is_judged_by_its_distance():
    """In the wall's row, beside it, and two away; the wall is nearer to the row above."""
    grid = grid_with((5, 0), (6, 1), (4, 2), (7, 3), (3, 4), (0, 9))
    accuracy = map_accuracy(grid, IDENTITY, WALL, WALL, CELL_M)
    assert (accuracy.occupied_cells, accuracy.correct_fraction) == (6, 3 / 6)
    assert accuracy.close_fraction == 2 / 6
    assert map_accuracy(grid, IDENTITY, WALL, WALL, 0.2).correct_fraction == 5 / 6
    # At a border a wall is in one row, and the next one's middle is further than a cell.
    border = WALL + [0.0, 0.05]
    assert map_accuracy(grid_with((7, 0)), IDENTITY, border, border, CELL_M)[1:3] == (1.0, 0.0)


def test_only_the_visible_surface_must_be_mapped():
    grid = grid_with((5, 0), (5, 1), (6, 2), (8, 7))
    accuracy = map_accuracy(grid, IDENTITY, WALL, WALL, CELL_M)
    assert accuracy.mapped_fraction == pytest.approx(0.3)  # columns 0 to 2; of 3, no neighbour
    assert map_accuracy(grid, IDENTITY, WALL, WALL[:40], CELL_M).mapped_fraction == pytest.approx(0.75)


def test_a_map_in_a_frame_of_its_own():
    """The grid's origin in the map, and the map in the world, are both turned."""
    place, origin = Pose2D(3.0, -1.0, 0.7), Pose2D(-0.2, 0.4, -0.3)
    whole = place.compose(origin)
    wall = np.array([whole.compose(Pose2D(x, y, 0.0))[:2] for x, y in WALL.tolist()])
    grid = grid_with((5, 0), (6, 1), (8, 2), origin=origin)
    accuracy = map_accuracy(grid, place, wall, wall, CELL_M)
    assert accuracy.correct_fraction == pytest.approx(2 / 3)
    assert accuracy.mapped_fraction == pytest.approx(0.2)


def test_an_empty_map_has_mapped_nothing():
    accuracy = map_accuracy(grid_with(), IDENTITY, WALL, WALL, CELL_M)
    assert accuracy.occupied_cells == 0 and accuracy.mapped_fraction == 0.0
    assert math.isnan(accuracy.correct_fraction)
    with pytest.raises(ConfigError, match='no map can be compared'):
        map_accuracy(grid_with(), IDENTITY, WALL, WALL[:0], CELL_M)


def solid(shape, x_m, y_m):
    pose = np.eye(4)
    pose[:3, 3] = x_m, y_m, 0.5
    return Solid(f'{x_m}/{y_m}', shape, pose)


@pytest.fixture(scope='module')
def box_room():
    """4 x 4 m inside, walls of 0.2 m whose ends overlap, and a pillar."""
    solids = [
        solid(Box((4.4, 0.2, 1.0)), 0.0, 2.1),
        solid(Box((4.4, 0.2, 1.0)), 0.0, -2.1),
        solid(Box((0.2, 4.4, 1.0)), 2.1, 0.0),
        solid(Box((0.2, 4.4, 1.0)), -2.1, 0.0),
        solid(Cylinder(0.3, 1.0), 1.0, 0.0),
    ]
    return World('room', [Model('room', np.eye(4), solids)])


def test_the_surface_is_what_faces_the_free_space(box_room):
    surface = true_surface(box_room, 0.3, 0.0, 0.0)
    length_m = len(surface) * SPACING_M
    assert length_m == pytest.approx(16.0 + 2 * math.pi * 0.3, rel=0.03)
    assert np.abs(surface).max() <= 2.0 + 0.05


def test_what_is_hidden_or_far_is_not_visible(box_room):
    surface = true_surface(box_room, 0.3, 0.0, 0.0)
    bearings = -math.pi + 2 * math.pi / 2000 * np.arange(2000)
    seen = visible_points(box_room, 0.3, surface, [IDENTITY], bearings, 10.0)
    behind = seen[(seen[:, 0] > 1.9) & (np.abs(seen[:, 1]) < 0.55)]
    # The pillar's shadow on the wall behind: tangents at asin(0.3 / 1).
    assert len(behind) == 0
    shadow_m = 2 * 2.0 * math.tan(math.asin(0.3))
    far_side = 2 * math.pi * 0.3 * (0.5 + math.asin(0.3) / math.pi)
    assert len(seen) * SPACING_M == pytest.approx(len(surface) * SPACING_M - shadow_m - far_side, abs=0.15)
    near = visible_points(box_room, 0.3, surface, [IDENTITY], bearings, 1.5)
    assert len(near) and (np.abs(near[:, 1]) < 0.32).all()
    both = visible_points(box_room, 0.3, surface, [IDENTITY, Pose2D(1.7, 0.0, 2.0)], bearings, 10.0)
    assert (len(both) - len(seen)) * SPACING_M > shadow_m + 0.3


SCAN_HEIGHT_M, RANGE_M, NEAR_M = 1.12, 5.9, 0.05
BEARINGS_RAD = np.linspace(-math.pi, math.pi, 720, endpoint=False)


def tour(name):
    """Where the robot came by, each half second."""
    test = load_params(TestDefinition, ROOT / 'config' / 'mapping' / f'{name}.yaml')
    drive, poses = ScriptedDrive(test), [test.start.pose()]
    for step in range(int(2.0 * drive.duration_s)):
        linear, angular = drive.command(0.5 * step, 0.5 * (step + 1))
        poses.append(move_along_arc(poses[-1], 0.5 * linear, 0.5 * angular))
    return poses


@pytest.mark.parametrize('name', ['hallway', 'ros_logo'])
def test_it_is_true_to_its_world(name):
    world, poses = load_world(ROOT / 'worlds' / f'{name}.world'), tour(name)
    surface = true_surface(world, SCAN_HEIGHT_M, poses[0].x_m, poses[0].y_m)
    visible = visible_points(world, SCAN_HEIGHT_M, surface, poses[::2], BEARINGS_RAD, RANGE_M)
    accuracy = map_accuracy(load_map(ROOT / 'worlds' / f'{name}.yaml'), IDENTITY, surface, visible, NEAR_M)
    assert accuracy.correct_fraction >= 0.99
    assert accuracy.mapped_fraction >= 0.97
