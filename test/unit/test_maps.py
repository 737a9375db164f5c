"""Map files as map_server reads them, and maps straight from world files."""
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.mapping.map_files import load_map, save_map
from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.mapping.rasterise import rasterise, surface_points
from diff_encoder_sim.se2 import Pose2D
from diff_encoder_sim.simulation.world import load_world

WORLDS = Path(__file__).resolve().parents[2] / 'worlds'
YAML = 'image: m.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\n'


def write(folder, pixels, text=YAML, name='m.pgm'):
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(folder / name)
    (folder / 'm.yaml').write_text(text)
    return folder / 'm.yaml'


def test_a_map_by_hand_first_row_on_top(tmp_path):
    grid = load_map(write(tmp_path, [[0, 254, 205], [254, 254, 0]]))
    assert grid.cells.tolist() == [[0, 0, 100], [100, 0, -1]]
    assert (grid.width, grid.height, grid.resolution_m) == (3, 2, 0.05)
    assert grid.origin == (-1.0, -2.0, 0.0)


def test_cells_and_points_agree_on_a_turned_map():
    grid = OccupancyGrid(np.zeros((4, 6), dtype=np.int8), 0.5, Pose2D(1.0, 2.0, math.pi / 2))
    assert grid.cell_centre(0, 0) == pytest.approx((0.75, 2.25))
    for row in range(4):
        for column in range(6):
            assert grid.cell_at(*grid.cell_centre(row, column)) == (row, column)


# Occupancies of these greys: 0.961, 0.608, 0.137, 0.020; negated 0.039, 0.392, 0.863, 0.980.
@pytest.mark.parametrize('keys, cells', [
    ('', [100, -1, 0, 0]), ('negate: 1\n', [0, -1, 100, 100]),
    ('mode: scale\n', [100, 89, 0, 0]), ('mode: raw\n', [10, 100, -1, -1]),
    ('occupied_thresh: 0.5\nfree_thresh: 0.1\n', [100, 100, -1, 0])])
def test_modes_and_thresholds(tmp_path, keys, cells):
    path = write(tmp_path, [[10, 100, 220, 250]], YAML + keys)
    assert load_map(path).cells.tolist() == [cells]


def test_alpha_marks_the_unknown_in_scale_mode(tmp_path):
    pixels = [[[0, 0, 0, 255], [0, 0, 0, 0], [128, 128, 128, 0], [255, 255, 255, 255]]]
    text = YAML.replace('m.pgm', 'm.png') + 'mode: scale\n'
    assert load_map(write(tmp_path, pixels, text, 'm.png')).cells.tolist() == [[100, 100, -1, 0]]


def test_what_is_saved_is_read_back(tmp_path):
    cells = np.random.default_rng(1).choice([FREE, OCCUPIED, UNKNOWN], (7, 9)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, Pose2D(-1.5, 0.25, 0.1))
    again = load_map(save_map(grid, tmp_path / 'saved'))
    assert (again.cells == cells).all()
    assert (again.resolution_m, again.origin) == (grid.resolution_m, grid.origin)


@pytest.mark.parametrize('text, complaint', [
    (YAML.replace('0.05', '0'), 'm.yaml: resolution: given 0'),
    (YAML.replace('0.05', '.nan'), 'm.yaml: resolution: given nan'),
    (YAML.replace('-1.0', '.nan'), 'm.yaml: origin.0: given nan'),
    (YAML.replace(', 0.0]', ']'), 'm.yaml: origin: given'),
    (YAML.replace('m.pgm', 'n.pgm'), 'n.pgm: cannot be read: No such file'),
    (YAML.replace('m.pgm', 'm.yaml'), 'm.yaml: not an image'),
    (YAML + 'mode: grey\n', "m.yaml: mode: given 'grey'"),
    (YAML + 'occupied_thresh: 0.1\n', 'free_thresh below occupied_thresh'),
    (YAML + 'colour: 1\n', 'm.yaml: colour: unknown key'),
    ('image: m.pgm\n', 'm.yaml: resolution: missing')])
def test_a_bad_map_file_is_named(tmp_path, text, complaint):
    path = write(tmp_path, [[0, 254]], text)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_map(path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('content', [b'', b'P5\n0 0\n255\n', b'P5\n10 10\n255\nxx', b'P5\n-3 x'])
def test_an_image_without_pixels_is_named(tmp_path, content):
    path = write(tmp_path, [[0]])
    (tmp_path / 'm.pgm').write_bytes(content)
    with pytest.raises(ConfigError, match='m.pgm: '):
        load_map(path)


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path):
    with pytest.raises(ConfigError, match='cannot be written to'):
        save_map(OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, Pose2D(0, 0, 0)),
                 tmp_path / 'no' / 'folder' / 'map')


@pytest.mark.parametrize('name, free', [('hallway', (-10.0, 0.0)), ('ros_logo', (-3.4, -0.85))])
def test_a_rasterised_world_has_its_surfaces_and_nothing_else(name, free):
    world = load_world(WORLDS / f'{name}.world')
    grid = rasterise(world, 1.12, 0.05, *free)
    points_m = surface_points(world, 1.12, 0.01)
    occupied_m = np.array([grid.cell_centre(row, column)
                           for row, column in np.argwhere(grid.cells == OCCUPIED)])
    nearest_m = np.array([np.hypot(*(points_m - centre).T).min() for centre in occupied_m])
    assert nearest_m.max() < 0.05 * math.sqrt(0.5) + 0.01  # a surface runs through the cell
    assert grid.cells[grid.cell_at(*free)] == FREE
    assert (grid.cells[[0, -1]] == UNKNOWN).all() and (grid.cells[:, [0, -1]] == UNKNOWN).all()


def test_the_hallways_walls_are_drawn_alike_on_both_sides():
    grid = rasterise(load_world(WORLDS / 'hallway.world'), 1.12, 0.05, -10.0, 0.0)
    y_m = np.array([grid.cell_centre(row, 0)[1] for row in range(grid.height)])
    occupied = (grid.cells == OCCUPIED).sum(axis=1)
    for wall_m in (3.0, -3.0):
        assert occupied[np.argmin(np.abs(y_m - wall_m))] > 200
        assert np.abs(y_m - wall_m).min() < 1e-6


def test_a_free_point_in_a_wall_or_outside_is_refused():
    world = load_world(WORLDS / 'hallway.world')
    for point in ((16.1, 0.0), (500.0, 0.0)):
        with pytest.raises(ConfigError, match='free point'):
            rasterise(world, 1.12, 0.05, *point)
    with pytest.raises(ConfigError, match='nothing to map'):
        rasterise(world, 30.0, 0.05, 0.0, 0.0)
