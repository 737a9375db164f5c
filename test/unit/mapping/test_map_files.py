"""Map files as map_server reads them, and maps straight from world files."""

import io
import math
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli.rasterise_world import main as rasterise_world
from diff_encoder_sim.mapping.map_files import SavingParams, load_map, save_map
from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.simulation.rasterise import rasterise, surface_points
from diff_encoder_sim.simulation.world import load_world
from places import WORLDS

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
@pytest.mark.parametrize(
    ('keys', 'cells'),
    [
        ('', [100, -1, 0, 0]),
        ('negate: 1\n', [0, -1, 100, 100]),
        ('mode: scale\n', [100, 89, 0, 0]),
        ('mode: raw\n', [10, 100, -1, -1]),
        ('mode: scale\nnegate: 1\n', [0, 43, 100, 100]),
        ('mode: raw\nnegate: 1\n', [-1, -1, 35, 5]),
        ('occupied_thresh: 0.5\nfree_thresh: 0.1\n', [100, 100, -1, 0]),
    ],
)
def test_modes_and_thresholds(tmp_path, keys, cells):
    path = write(tmp_path, [[10, 100, 220, 250]], YAML + keys)
    assert load_map(path).cells.tolist() == [cells]


def test_alpha_marks_the_unknown_in_scale_mode(tmp_path):
    pixels = [[[0, 0, 0, 255], [0, 0, 0, 0], [128, 128, 128, 0], [255, 255, 255, 255]]]
    text = YAML.replace('m.pgm', 'm.png') + 'mode: scale\n'
    assert load_map(write(tmp_path, pixels, text, 'm.png')).cells.tolist() == [[100, 100, -1, 0]]


def test_alpha_is_one_more_channel_in_trinary_mode_and_none_in_raw_mode(tmp_path):
    """(150 + 150 + 150 + 255) / 4 = 176: occupancy 0.309 instead of 0.412."""
    pixels = [[[150, 150, 150, 255], [150, 150, 150, 0], [90, 90, 90, 0], [90, 91, 92, 255], [100, 100, 101, 9]]]
    text = YAML.replace('m.pgm', 'm.png') + 'occupied_thresh: 0.4\n'
    assert load_map(write(tmp_path, pixels, text, 'm.png')).cells.tolist() == [[-1, 100, 100, 100, 100]]
    assert load_map(write(tmp_path, pixels, text + 'mode: raw\n', 'm.png')).cells.tolist() == [[-1, -1, 90, 91, 100]]


def test_grey_with_alpha_is_read_as_colour_with_alpha(tmp_path):
    """So does SDL: (3 * 0 + 255) / 4 = 64 is an occupancy of 0.75, 205 of 0.147, (254, 0) of 0.253."""
    pixels = np.array([[[0, 255], [100, 255], [205, 255], [254, 0]]], dtype=np.uint8)
    text = YAML.replace('m.pgm', 'm.png')
    for mode, cells in (('trinary', [100, -1, 0, -1]), ('scale', [100, 89, 1, 0]), ('raw', [0, 100, -1, -1])):
        path = write(tmp_path, pixels, text + f'mode: {mode}\n', 'm.png')
        assert load_map(path).cells.tolist() == [cells], mode


GREYS = [[0, 205, 254]]  # occupied, unknown, free


def png(image, **options):
    file = io.BytesIO()
    image.save(file, 'PNG', **options)
    return file.getvalue()


def of_palette():
    image = Image.new('P', (3, 1))
    image.putpalette([7, 7, 7, 0, 0, 0, 205, 205, 205, 254, 254, 254])
    image.putdata([1, 2, 3])
    return image


@pytest.mark.parametrize(
    'content',
    [
        b'P2 3 1 255 0 205 254',
        b'P2 3 1 510 0 410 508',
        b'P5 3 1 255\n\x00\xcd\xfe',
        b'P5 3 1 65535\n\x00\x00\xcd\xcd\xfe\xfe',
        b'P3 3 1 255 0 0 0 205 205 205 254 254 254',
        png(Image.fromarray(np.array(GREYS, dtype=np.uint8))),
        png(Image.fromarray(np.array(GREYS, dtype=np.uint16) * 257)),
        png(Image.fromarray(np.array(GREYS, dtype=np.uint8)).convert('RGB')),
        png(of_palette()),
        png(of_palette(), transparency=0),
    ],
)
def test_every_kind_of_pixel_is_read_alike(tmp_path, content):
    # Averaged with alpha, as trinary mode does, 205 is 217.5: an occupancy just above 0.147.
    path = write(tmp_path, GREYS, YAML.replace('m.pgm', 'm') + 'free_thresh: 0.147\n')
    (tmp_path / 'm').write_bytes(content)
    assert load_map(path).cells.tolist() == [[OCCUPIED, UNKNOWN, FREE]]


@pytest.mark.parametrize(('mode', 'transparent'), [('L', 205), ('L', 7), ('RGB', (205, 205, 205))])
def test_one_transparent_colour_is_no_alpha(tmp_path, mode, transparent):
    """Averaged with an alpha of 255, 205 would be free."""
    path = write(tmp_path, GREYS, YAML.replace('m.pgm', 'm'))
    image = Image.fromarray(np.array(GREYS, dtype=np.uint8)).convert(mode)
    (tmp_path / 'm').write_bytes(png(image, transparency=transparent))
    assert load_map(path).cells.tolist() == [[OCCUPIED, UNKNOWN, FREE]]


def test_of_16_bits_the_upper_8_count(tmp_path):
    pixels = np.array([[0, 255, 256, 100 * 256, 100 * 257, 101 * 256]], dtype=np.uint16)
    path = write(tmp_path, GREYS, YAML.replace('m.pgm', 'm') + 'mode: raw\n')
    (tmp_path / 'm').write_bytes(png(Image.fromarray(pixels)))
    assert load_map(path).cells.tolist() == [[0, 0, 1, 100, 100, -1]]


def test_black_and_white_of_one_bit(tmp_path):
    path = write(tmp_path, GREYS)
    (tmp_path / 'm.pgm').write_bytes(b'P4 3 1\n\x40')  # 1 is black
    assert load_map(path).cells.tolist() == [[FREE, OCCUPIED, FREE]]


def test_numbers_are_read_as_map_servers_parser_reads_them(tmp_path):
    """To PyYAML an exponent without a point, and a number in quotes, are text."""
    text = 'image: m.pgm\nresolution: 5e-2\norigin: [1e-05, "-2.5", 0]\noccupied_thresh: "0.65"\nfree_thresh: 2e-1\n'
    grid = load_map(write(tmp_path, GREYS, text))
    assert (grid.resolution_m, grid.origin) == (0.05, (1e-05, -2.5, 0.0))
    assert grid.cells.tolist() == [[OCCUPIED, FREE, FREE]]  # 205 is an occupancy of 0.196


@pytest.mark.parametrize('resolution_m', [0.01, 0.025, 0.1, 1.0])
def test_maps_of_any_resolution_come_back(tmp_path, resolution_m):
    grid = OccupancyGrid(np.zeros((2, 3), dtype=np.int8), resolution_m, Pose2D(0, 0, 0))
    assert load_map(save_map(grid, tmp_path / 'm')).resolution_m == resolution_m


def test_what_is_saved_is_read_back(tmp_path):
    cells = np.random.default_rng(1).choice([FREE, OCCUPIED, UNKNOWN], (7, 9)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, Pose2D(-1.5, 0.25, 0.1))
    again = load_map(save_map(grid, tmp_path / 'saved'))
    assert (again.cells == cells).all()
    assert (again.resolution_m, again.origin) == (grid.resolution_m, grid.origin)


def test_thresholds_of_saving_are_inclusive(tmp_path):
    grid = OccupancyGrid(np.array([[0, 25, 26, 64, 65, 100, -1]], dtype=np.int8), 0.05, Pose2D(0, 0, 0))
    assert load_map(save_map(grid, tmp_path / 'm')).cells.tolist() == [[0, 0, -1, -1, 100, 100, -1]]
    params = SavingParams(free=0, occ=26)
    assert load_map(save_map(grid, tmp_path / 'm', params)).cells.tolist() == [[0, -1, 100, 100, 100, 100, -1]]


@pytest.mark.parametrize(
    ('options', 'complaint'),
    [
        ({'occ': 0}, 'occ: given 0'),
        ({'free': 101}, 'free: given 101'),
        ({'free': -1}, 'free: given -1'),
        ({'free': 65}, 'free below occ'),
        ({'occ': 20}, 'free below occ'),
    ],
)
def test_bad_thresholds_of_saving_are_named(options, complaint):
    with pytest.raises(ConfigError, match=complaint):
        SavingParams.from_mapping(options, 'arguments')


def test_saving_replaces_files_whole_and_leaves_nothing_else(tmp_path, monkeypatch):
    grids = [OccupancyGrid(np.full((2, 3), cell, dtype=np.int8), 0.05, Pose2D(0, 0, 0)) for cell in (FREE, OCCUPIED)]
    path = save_map(grids[0], tmp_path / 'm')

    def fail(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, 'replace', fail)  # all is written by then
    with pytest.raises(ConfigError, match='m.pgm: cannot be written: No space left'):
        save_map(grids[1], tmp_path / 'm')
    assert load_map(path).cells.tolist() == grids[0].cells.tolist()
    monkeypatch.undo()
    save_map(grids[1], tmp_path / 'm')
    assert load_map(path).cells.tolist() == grids[1].cells.tolist()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ['m.pgm', 'm.yaml']


@pytest.mark.parametrize(
    ('text', 'complaint'),
    [
        (YAML.replace('0.05', '0'), 'm.yaml: resolution: given 0'),
        (YAML.replace('0.05', '2001-99-99'), 'm.yaml: not valid YAML'),  # an error of datetime's
        (YAML.replace('m.pgm', '"m\\n.pgm"'), 'm.yaml: image: given .* allowed: a file name'),
        (YAML.replace('m.pgm', '"m\\0.pgm"'), 'm.yaml: image: given .* allowed: a file name'),
        (YAML + 'negate: 2\n', 'm.yaml: negate: given 2'),
        (YAML.replace('0.05', '.nan'), 'm.yaml: resolution: given nan'),
        (YAML.replace('0.05', '"nan"'), 'm.yaml: resolution: given nan'),
        (YAML.replace('0.05', 'fine'), "m.yaml: resolution: given 'fine'; allowed: a valid number"),
        (YAML.replace('-1.0', '.nan'), 'm.yaml: origin.0: given nan'),
        (YAML.replace(', 0.0]', ']'), 'm.yaml: origin: given'),
        (YAML.replace('m.pgm', 'n.pgm'), 'n.pgm: cannot be read: No such file'),
        (YAML.replace('m.pgm', 'm.yaml'), 'm.yaml: not an image'),
        (YAML + 'mode: grey\n', "m.yaml: mode: given 'grey'"),
        (YAML + 'occupied_thresh: 0.1\n', 'free_thresh below occupied_thresh'),
        (YAML + 'colour: 1\n', 'm.yaml: colour: unknown key'),
        ('image: m.pgm\n', 'm.yaml: resolution: missing'),
    ],
)
def test_a_bad_map_file_is_named(tmp_path, text, complaint):
    path = write(tmp_path, [[0, 254]], text)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_map(path)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (b'', 'not an image'),
        (b'P5\n0 0\n255\n', 'without pixels'),
        (b'P5\n-3 x', 'cannot be read'),
        (b'P5\n10 10\n255\nxx', 'truncated'),
        (png(Image.new('L', (99, 99)))[:60], 'cannot be read'),
        (b'P5\n9500 9500\n255\n', 'too large; allowed: at most 89478485 pixels'),
        (b'P5\n1000000 1000000\n255\n', 'too large'),
        (b'Pf 1 1 -1\n\0\0\0\0', 'pixels of type F'),
        (b'GIF89a\x01\x00\x01\x00\x00\x00\x00;', 'allowed: PGM or PNG'),
    ],
)
def test_an_image_that_is_no_map_is_named(tmp_path, content, complaint):
    path = write(tmp_path, [[0]])
    (tmp_path / 'm.pgm').write_bytes(content)
    with pytest.raises(ConfigError, match='m.pgm: ') as caught:
        load_map(path)
    assert complaint in str(caught.value)
    assert '\n' not in str(caught.value)


NUMBERS = st.one_of(st.sampled_from([0, 1, -1, 0.05, 0.196, 0.65]), st.floats(), st.integers())
VALUES = st.recursive(
    st.one_of(NUMBERS, st.text(), st.booleans(), st.none(), st.dates()),
    lambda inner: st.lists(inner, max_size=4),
    max_leaves=4,
)
GOOD = {'image': 'm', 'resolution': 0.05, 'origin': [0.0, 0.0, 0.0]}
DESCRIPTIONS = st.one_of(
    st.fixed_dictionaries(
        {
            'image': st.one_of(st.just('m'), VALUES),
            'resolution': st.one_of(st.just(0.05), VALUES),
            'origin': st.one_of(st.just([0, 0, 0]), st.lists(NUMBERS, min_size=3, max_size=3), VALUES),
        },
        optional={
            'mode': st.sampled_from(['trinary', 'scale', 'raw', 'grey', 1]),
            'negate': st.one_of(st.sampled_from([0, 1]), VALUES),
            'occupied_thresh': NUMBERS,
            'free_thresh': NUMBERS,
        },
    ).map(lambda keys: yaml.safe_dump(keys).encode()),
    st.just(yaml.safe_dump(GOOD).encode()),
    st.text().map(lambda text: b'image: m\n' + text.encode('utf-8', 'surrogatepass')),
    st.binary(),
)
IMAGES = [
    b'P2 3 2 255 0 1 2 3 4 5',
    b'P5 3 2 65535\n' + bytes(12),
    b'P6 1 1 255\n123',
    b'P1 2 1 0 1',
    png(Image.new('L', (5, 4))),
    png(Image.new('LA', (5, 4))),
    png(of_palette()),
]


@st.composite
def torn_images(draw):
    """A good image, cut off somewhere and with bytes changed."""
    content = bytearray(draw(st.sampled_from(IMAGES)))
    for _ in range(draw(st.integers(0, 3))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(content[: draw(st.integers(0, len(content)))])


@given(DESCRIPTIONS, st.one_of(st.sampled_from(IMAGES), torn_images(), st.binary(max_size=40)))
def test_whatever_the_files_hold_a_map_comes_out_or_one_line(description, image):
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, 'm').write_bytes(image)
        Path(folder, 'm.yaml').write_bytes(description)
        try:
            grid = load_map(Path(folder, 'm.yaml'))
        except ConfigError as error:
            assert '\n' not in str(error)
            return
        cells = grid.cells
        assert cells.dtype == np.int8 and cells.size > 0
        assert ((cells >= UNKNOWN) & (cells <= OCCUPIED)).all()
        assert grid.resolution_m > 0 and np.isfinite(grid.origin).all()


@pytest.mark.parametrize(
    ('stem', 'complaint'),
    [
        ('no/folder/map', 'map.pgm: cannot be written: No such file'),
        ('', 'a folder'),
        ('m.yaml/map', 'map.pgm: cannot be written: Not a directory'),
    ],
)
def test_a_place_that_cannot_be_written_to_is_named(tmp_path, monkeypatch, stem, complaint):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.yaml').write_text(YAML)
    with pytest.raises(ConfigError, match=complaint):
        save_map(OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, Pose2D(0, 0, 0)), stem)


@pytest.mark.parametrize(('name', 'free'), [('hallway', (-10.0, 0.0)), ('ros_logo', (-3.4, -0.85))])
def test_a_rasterised_world_has_its_surfaces_and_nothing_else(name, free):
    world = load_world(WORLDS / f'{name}.world')
    grid = rasterise(world, 1.12, 0.05, *free)
    points_m = surface_points(world, 1.12, 0.01)
    occupied_m = np.array([grid.cell_centre(row, column) for row, column in np.argwhere(grid.cells == OCCUPIED)])
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
        with pytest.raises(ConfigError, match=rf'free point \({point[0]}, 0.0\)'):
            rasterise(world, 1.12, 0.05, *point)
    with pytest.raises(ConfigError, match='nothing to map'):
        rasterise(world, 30.0, 0.05, 0.0, 0.0)
    with pytest.raises(ConfigError, match='resolution 0.001 m: a map of .* cells; allowed: at most'):
        rasterise(world, 1.12, 0.001, 0.0, 0.0)


def test_the_tool_writes_a_map_that_is_read_back(tmp_path, capsys):
    world_file = str(WORLDS / 'hallway.world')
    rasterise_world([world_file, '--free', '-10', '0', '--resolution', '0.1', '--out', str(tmp_path / 'hall')])
    assert capsys.readouterr().out.strip() == str(tmp_path / 'hall.yaml')
    grid, expected = load_map(tmp_path / 'hall.yaml'), rasterise(load_world(world_file), 1.12, 0.1, -10.0, 0.0)
    assert (grid.cells == expected.cells).all() and grid.origin == expected.origin


@pytest.mark.parametrize(
    ('arguments', 'complaint'),
    [
        (['--resolution', '0'], 'resolution: given 0'),
        (['--resolution', '-1'], 'resolution: given -1'),
        (['--resolution', 'nan'], 'resolution: given nan'),
        (['--resolution', '1e-9'], 'resolution: given 1e-09'),
        (['--resolution', '1e300'], 'resolution: given 1e'),
        (['--height', 'inf'], 'height: given inf'),
        (['--free', '0', 'nan'], 'free.1: given nan'),
        (['--free', '1e300', '0'], 'free point'),
    ],
)
def test_the_tool_names_a_bad_argument_in_one_line(tmp_path, arguments, complaint):
    with pytest.raises(SystemExit) as caught:
        rasterise_world([str(WORLDS / 'hallway.world'), '--out', str(tmp_path / 'm'), *arguments])
    assert complaint in caught.value.code and '\n' not in caught.value.code
    assert not list(tmp_path.iterdir())
