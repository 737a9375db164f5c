"""Small map files."""

import io

import numpy as np
from PIL import Image

YAML = 'image: m.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\n'
GREYS = [[0, 205, 254]]  # occupied, unknown, free


def write_map(folder, pixels, text=YAML, name='m.pgm'):
    """Write pixels as image `name` and `text` as m.yaml beside it; return the path of m.yaml."""
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(folder / name)
    (folder / 'm.yaml').write_text(text)
    return folder / 'm.yaml'


def png(image, **options):
    """Return an image as the bytes of a PNG file."""
    file = io.BytesIO()
    image.save(file, 'PNG', **options)
    return file.getvalue()


def palette_image():
    """Return GREYS as an image of indices into a palette."""
    image = Image.new('P', (3, 1))
    image.putpalette([7, 7, 7, 0, 0, 0, 205, 205, 205, 254, 254, 254])
    image.putdata([1, 2, 3])
    return image
