"""Images of map files, of every pixel type that SDL reads."""

import tracemalloc

import numpy as np
import pytest
from PIL import Image

from bag_bombs import png_of_zeros
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from map_samples import GREYS, YAML, palette_image, png, write_map


def test_grey_with_alpha_is_read_as_colour_with_alpha(tmp_path):
    """So does SDL: (3 * 0 + 255) / 4 = 64 is an occupancy of 0.75, 205 of 0.147, (254, 0) of 0.253."""
    pixels = np.array([[[0, 255], [100, 255], [205, 255], [254, 0]]], dtype=np.uint8)
    text = YAML.replace('m.pgm', 'm.png')
    for mode, cells in (('trinary', [100, -1, 0, -1]), ('scale', [100, 89, 1, 0]), ('raw', [0, 100, -1, -1])):
        path = write_map(tmp_path, pixels, text + f'mode: {mode}\n', 'm.png')
        assert load_map(path).cells.tolist() == [cells], mode


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
        png(palette_image()),
        png(palette_image(), transparency=0),
    ],
)
def test_every_kind_of_pixel_is_read_alike(tmp_path, content):
    # Averaged with alpha, as trinary mode does, 205 is 217.5: an occupancy just above 0.147.
    path = write_map(tmp_path, GREYS, YAML.replace('m.pgm', 'm') + 'free_thresh: 0.147\n')
    (tmp_path / 'm').write_bytes(content)
    assert load_map(path).cells.tolist() == [[OCCUPIED, UNKNOWN, FREE]]


@pytest.mark.parametrize(('mode', 'transparent'), [('L', 205), ('L', 7), ('RGB', (205, 205, 205))])
def test_one_transparent_colour_is_no_alpha(tmp_path, mode, transparent):
    """Averaged with an alpha of 255, 205 would be free."""
    path = write_map(tmp_path, GREYS, YAML.replace('m.pgm', 'm'))
    image = Image.fromarray(np.array(GREYS, dtype=np.uint8)).convert(mode)
    (tmp_path / 'm').write_bytes(png(image, transparency=transparent))
    assert load_map(path).cells.tolist() == [[OCCUPIED, UNKNOWN, FREE]]


def test_of_16_bits_the_upper_8_count(tmp_path):
    pixels = np.array([[0, 255, 256, 100 * 256, 100 * 257, 101 * 256]], dtype=np.uint16)
    path = write_map(tmp_path, GREYS, YAML.replace('m.pgm', 'm') + 'mode: raw\n')
    (tmp_path / 'm').write_bytes(png(Image.fromarray(pixels)))
    assert load_map(path).cells.tolist() == [[0, 0, 1, 100, 100, -1]]


def test_black_and_white_of_one_bit(tmp_path):
    path = write_map(tmp_path, GREYS)
    (tmp_path / 'm.pgm').write_bytes(b'P4 3 1\n\x40')  # 1 is black
    assert load_map(path).cells.tolist() == [[FREE, OCCUPIED, FREE]]


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (b'', 'not an image'),
        (b'P5\n0 0\n255\n', 'without pixels'),
        (b'P5\n-3 x', 'cannot be read'),
        (b'P5\n10 10\n255\nxx', 'truncated'),
        (png(Image.new('L', (99, 99)))[:60], 'cannot be read'),
        (b'P5\n5793 5793\n255\n', 'too large; allowed: at most 33554432 pixels'),
        (b'P5\n9500 9500\n255\n', 'too large; allowed: at most 33554432 pixels'),
        (b'P5\n1000000 1000000\n255\n', 'too large'),
        (b'Pf 1 1 -1\n\0\0\0\0', 'pixels of type F'),
        (b'GIF89a\x01\x00\x01\x00\x00\x00\x00;', 'allowed: PGM or PNG'),
    ],
)
def test_an_image_that_is_no_map_is_named(tmp_path, content, complaint):
    path = write_map(tmp_path, [[0]])
    (tmp_path / 'm.pgm').write_bytes(content)
    with pytest.raises(ConfigError, match=r'm\.pgm: ') as caught:
        load_map(path)
    assert complaint in str(caught.value)
    assert '\n' not in str(caught.value)


def test_an_image_of_many_pixels_is_refused_before_it_is_decompressed(tmp_path):
    """64 million pixels in 64 kB."""
    path = write_map(tmp_path, [[0]])
    (tmp_path / 'm.pgm').write_bytes(png_of_zeros(8000, 8000))
    assert (tmp_path / 'm.pgm').stat().st_size < 100_000
    tracemalloc.start()
    try:
        with pytest.raises(ConfigError, match=r'm\.pgm: image too large; allowed: at most 33554432 pixels'):
            load_map(path)
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()
