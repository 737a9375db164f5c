"""Map files as map_server reads and map_saver writes them, with images of every pixel type."""

import io

import numpy as np
import pytest
from PIL import Image

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.map_files import MapSaverParams, load_map, save_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

YAML = 'image: m.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\n'
GREYS = [[0, 205, 254]]  # occupied, unknown, free


def write_map(folder, pixels, text=YAML, name='m.pgm'):
    """Write pixels as image `name` and `text` as m.yaml beside it; return the path of m.yaml."""
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(folder / name)
    (folder / 'm.yaml').write_text(text)
    return folder / 'm.yaml'


def png(image, **options):
    file = io.BytesIO()
    image.save(file, 'PNG', **options)
    return file.getvalue()


def palette_image():
    image = Image.new('P', (3, 1))
    image.putpalette([7, 7, 7, 0, 0, 0, 205, 205, 205, 254, 254, 254])
    image.putdata([1, 2, 3])
    return image


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


@pytest.mark.parametrize(
    ('keys', 'cells'), [('occupied_thresh: 0.4\n', [-1, 100, 100, 100, 100]), ('mode: raw\n', [-1, -1, 90, 91, 100])]
)
def test_alpha_is_one_more_channel_in_trinary_mode_and_none_in_raw_mode(tmp_path, keys, cells):
    """(150 + 150 + 150 + 255) / 4 = 176: occupancy 0.309 instead of 0.412."""
    pixels = [[[150, 150, 150, 255], [150, 150, 150, 0], [90, 90, 90, 0], [90, 91, 92, 255], [100, 100, 101, 9]]]
    path = write_map(tmp_path, pixels, YAML.replace('m.pgm', 'm.png') + keys, 'm.png')
    assert load_map(path).cells.tolist() == [cells]


def test_what_is_saved_is_read_back(tmp_path):
    cells = np.random.default_rng(1).choice([FREE, OCCUPIED, UNKNOWN], (7, 9)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, Pose2D(-1.5, 0.25, 0.1))
    again = load_map(save_map(grid, tmp_path / 'm'))
    assert (again.cells == cells).all() and again[1:] == grid[1:]
    inclusive = grid._replace(cells=np.array([[0, 25, 26, 64, 65, 100, -1]], dtype=np.int8))
    assert load_map(save_map(inclusive, tmp_path / 'm')).cells.tolist() == [[0, 0, -1, -1, 100, 100, -1]]
    params = MapSaverParams(free=0, occ=26)
    assert load_map(save_map(inclusive, tmp_path / 'm', params)).cells.tolist() == [[0, -1, 100, 100, 100, 100, -1]]


@pytest.mark.parametrize(
    ('text', 'where'),
    [
        (YAML.replace('0.05', '0'), 'm.yaml: resolution: given 0'),
        (YAML.replace(', 0.0]', ']'), 'm.yaml: origin: given'),
        (YAML.replace('m.pgm', 'n.pgm'), 'n.pgm: '),
        (YAML + 'mode: grey\n', "m.yaml: mode: given 'grey'"),
        (YAML + 'occupied_thresh: 0.1\n', 'm.yaml: '),
        ('image: m.pgm\n', 'm.yaml: resolution: missing'),
    ],
)
def test_a_bad_map_file_is_named(tmp_path, text, where):
    with pytest.raises(ConfigError, match=where):
        load_map(write_map(tmp_path, [[0, 254]], text))


@pytest.mark.parametrize(
    'content',
    [
        b'P2 3 1 255 0 205 254',
        b'P5 3 1 255\n\x00\xcd\xfe',
        b'P5 3 1 65535\n\x00\x00\xcd\xcd\xfe\xfe',
        b'P3 3 1 255 0 0 0 205 205 205 254 254 254',
        png(Image.fromarray(np.array(GREYS, dtype=np.uint8))),
        png(Image.fromarray(np.array(GREYS, dtype=np.uint16) * 257)),
        png(Image.fromarray(np.array(GREYS, dtype=np.uint8)).convert('RGB')),
        png(palette_image()),
        png(palette_image(), transparency=0),
        png(Image.fromarray(np.array(GREYS, dtype=np.uint8)), transparency=205),  # one transparent grey is no alpha
    ],
)
def test_every_kind_of_pixel_is_read_alike(tmp_path, content):
    # Averaged with alpha, as trinary mode does, 205 is 217.5: an occupancy just above 0.147.
    path = write_map(tmp_path, GREYS, YAML.replace('m.pgm', 'm') + 'free_thresh: 0.147\n')
    (tmp_path / 'm').write_bytes(content)
    assert load_map(path).cells.tolist() == [[OCCUPIED, UNKNOWN, FREE]]


@pytest.mark.parametrize(
    'content', [b'', b'P5\n10 10\n255\nxx', b'P5\n6000 6000\n255\n', b'GIF89a\x01\x00\x01\x00\x00\x00\x00;']
)
def test_an_image_that_is_no_map_is_named(tmp_path, content):
    path = write_map(tmp_path, [[0]])
    (tmp_path / 'm.pgm').write_bytes(content)
    with pytest.raises(ConfigError, match=r'm\.pgm: '):
        load_map(path)
