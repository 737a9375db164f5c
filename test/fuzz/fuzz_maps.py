"""Map files: odd YAML and images, on which AMCL and the global costmap start."""

import io

import numpy as np
from PIL import Image

from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.map_files import load_map, save_map
from odd_values import damaged, odd_mapping, pick, write_yaml

GOOD = {
    'image': 'map.pgm', 'resolution': 0.05, 'origin': [-1.0, -1.0, 0.0], 'negate': 0, 'occupied_thresh': 0.65,
    'free_thresh': 0.196, 'mode': 'trinary',
}  # fmt: skip
MODES = ('1', 'L', 'LA', 'P', 'RGB', 'RGBA', 'I', 'I;16', 'CMYK', 'F')
FORMATS = ('PPM', 'PNG', 'PNG', 'TIFF', 'BMP', 'JPEG')


def warm_up(folder):
    (folder / 'map.pgm').write_bytes(_encoded(Image.fromarray(np.full((40, 60), 254, np.uint8)), 'PPM'))
    _use(write_yaml(np.random.default_rng(0), folder / 'map.yaml', GOOD))


def run(rng, folder):
    image = _image(rng)
    (folder / 'map.pgm').write_bytes(damaged(rng, image) if rng.random() < 0.3 else image)
    path = write_yaml(rng, folder / 'map.yaml', odd_mapping(rng, GOOD, 1) if rng.random() < 0.5 else GOOD)
    _use(path)


def _image(rng):
    height, width = (int(side) for side in rng.integers(1, pick(rng, (3, 60, 400)), 2))
    pixels = pick(rng, (0, 205, 254, None))
    grey = rng.integers(0, 256, (height, width)) if pixels is None else np.full((height, width), pixels)
    picture = Image.fromarray(grey.astype(np.uint8))
    try:
        return _encoded(picture.convert(pick(rng, MODES)), pick(rng, FORMATS))
    except (OSError, ValueError, KeyError):  # not every format has every mode
        return _encoded(picture, 'PNG')


def _encoded(picture, form):
    content = io.BytesIO()
    picture.save(content, format=form)
    return content.getvalue()


def _use(path):
    grid = load_map(path)
    Amcl(AmclParams(max_particles=200), grid, np.random.default_rng(0)).global_localization()
    save_map(grid.cropped(0.5), path.parent / 'again')
