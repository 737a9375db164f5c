"""Map files as map_server reads and map_saver writes them."""

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
from diff_encoder_sim.localization.map_files import MapSaverParams, load_map, save_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from map_samples import GREYS, YAML, palette_image, png, write_map


def test_a_map_by_hand_first_row_on_top(tmp_path):
    grid = load_map(write_map(tmp_path, [[0, 254, 205], [254, 254, 0]]))
    assert grid.cells.tolist() == [[0, 0, 100], [100, 0, -1]]
    assert (grid.width, grid.height, grid.resolution_m) == (3, 2, 0.05)
    assert grid.origin == (-1.0, -2.0, 0.0)


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
    path = write_map(tmp_path, [[10, 100, 220, 250]], YAML + keys)
    assert load_map(path).cells.tolist() == [cells]


def test_alpha_marks_the_unknown_in_scale_mode(tmp_path):
    pixels = [[[0, 0, 0, 255], [0, 0, 0, 0], [128, 128, 128, 0], [255, 255, 255, 255]]]
    text = YAML.replace('m.pgm', 'm.png') + 'mode: scale\n'
    assert load_map(write_map(tmp_path, pixels, text, 'm.png')).cells.tolist() == [[100, 100, -1, 0]]


def test_alpha_is_one_more_channel_in_trinary_mode_and_none_in_raw_mode(tmp_path):
    """(150 + 150 + 150 + 255) / 4 = 176: occupancy 0.309 instead of 0.412."""
    pixels = [[[150, 150, 150, 255], [150, 150, 150, 0], [90, 90, 90, 0], [90, 91, 92, 255], [100, 100, 101, 9]]]
    text = YAML.replace('m.pgm', 'm.png') + 'occupied_thresh: 0.4\n'
    assert load_map(write_map(tmp_path, pixels, text, 'm.png')).cells.tolist() == [[-1, 100, 100, 100, 100]]
    assert load_map(write_map(tmp_path, pixels, text + 'mode: raw\n', 'm.png')).cells.tolist() == [
        [-1, -1, 90, 91, 100]
    ]


def test_numbers_are_read_as_map_servers_parser_reads_them(tmp_path):
    """To PyYAML an exponent without a point, and a number in quotes, are text."""
    text = 'image: m.pgm\nresolution: 5e-2\norigin: [1e-05, "-2.5", 0]\noccupied_thresh: "0.65"\nfree_thresh: 2e-1\n'
    grid = load_map(write_map(tmp_path, GREYS, text))
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
    params = MapSaverParams(free=0, occ=26)
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
        MapSaverParams.from_mapping(options, 'arguments')


def test_saving_replaces_files_whole_and_leaves_nothing_else(tmp_path, monkeypatch):
    grids = [OccupancyGrid(np.full((2, 3), cell, dtype=np.int8), 0.05, Pose2D(0, 0, 0)) for cell in (FREE, OCCUPIED)]
    path = save_map(grids[0], tmp_path / 'm')

    def fail(*_):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(os, 'replace', fail)  # all is written by then
    with pytest.raises(ConfigError, match=r'm\.pgm: cannot be written: No space left'):
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
        (YAML.replace('0.05', '2001-99-99'), 'm.yaml, line 2: given 2001-99-99'),
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
    path = write_map(tmp_path, [[0, 254]], text)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_map(path)
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
    png(palette_image()),
]


@st.composite
def torn_images(draw):
    """A good image, cut off somewhere and with bytes changed."""
    content = bytearray(draw(st.sampled_from(IMAGES)))
    for _ in range(draw(st.integers(0, 3))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(content[: draw(st.integers(0, len(content)))])


def map_or_message(path):
    try:
        return load_map(path), None
    except ConfigError as error:
        return None, str(error)


@given(DESCRIPTIONS, st.one_of(st.sampled_from(IMAGES), torn_images(), st.binary(max_size=40)))
def test_whatever_the_files_hold_a_map_comes_out_or_one_line(description, image):
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, 'm').write_bytes(image)
        Path(folder, 'm.yaml').write_bytes(description)
        grid, message = map_or_message(Path(folder, 'm.yaml'))
        if grid is None:
            assert '\n' not in message
            return
        cells = grid.cells
        assert cells.dtype == np.int8 and cells.size > 0
        assert ((cells >= UNKNOWN) & (cells <= OCCUPIED)).all()
        assert grid.resolution_m > 0 and np.isfinite(grid.origin).all()


def test_folders_that_are_missing_are_made(tmp_path):
    grid = OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, Pose2D(0, 0, 0))
    assert save_map(grid, tmp_path / 'new' / 'folder' / 'm') == tmp_path / 'new' / 'folder' / 'm.yaml'


@pytest.mark.parametrize(
    ('stem', 'complaint'),
    [('', 'a folder'), ('m.yaml/map', 'map.pgm: cannot be written: (Not a directory|File exists)')],
)
def test_a_place_that_cannot_be_written_to_is_named(tmp_path, monkeypatch, stem, complaint):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.yaml').write_text(YAML)
    with pytest.raises(ConfigError, match=complaint):
        save_map(OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, Pose2D(0, 0, 0)), stem)
