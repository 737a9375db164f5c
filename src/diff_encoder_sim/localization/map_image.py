"""Read the image of a map file, PGM or PNG of any pixel type, as grey or colour of 8 bits."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from diff_encoder_sim.base.errors import ConfigError, in_one_line

FORMATS = ('PPM', 'PNG')  # PPM is PIL's name for all of PGM's family

# A PNG of 40 kB may have as many: they take up to 0.6 GB while they are read. A square of 290 m in cells of 5 cm.
LARGEST_IMAGE = 1 << 25


def read_image(path: Path) -> np.ndarray:
    """Return pixels (rows, columns, channels) uint8: one channel of grey, three of colour or four with alpha.

    As in SDL, by which map_server reads, grey with alpha becomes colour with alpha, and a single transparent
    grey or colour is not alpha; it matters where map_server averages all channels.

    Raises:
        ConfigError: the image cannot be read, or has more than `LARGEST_IMAGE` pixels.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('error', Image.DecompressionBombWarning)
            with Image.open(path, formats=FORMATS) as image:
                if image.width * image.height > LARGEST_IMAGE:
                    raise Image.DecompressionBombError
                return _pixels(image)
    except (Image.DecompressionBombWarning, Image.DecompressionBombError):
        raise ConfigError(f'{path}: image too large; allowed: at most {LARGEST_IMAGE} pixels') from None
    except UnidentifiedImageError:
        raise ConfigError(f'{path}: not an image, or one without pixels; allowed: PGM or PNG') from None
    except Exception as error:  # PIL raises many types for a damaged image
        reason = getattr(error, 'strerror', None)
        if reason is None:
            reason = f'truncated or damaged ({in_one_line(error)})'
        raise ConfigError(f'{path}: cannot be read: {reason}') from None


def _pixels(image: Image.Image) -> np.ndarray:
    """Return an open image's pixels as `read_image` does."""
    if image.mode.startswith('I'):  # 16 bits: the upper 8, as SDL
        return (np.asarray(image)[:, :, np.newaxis] >> 8).astype(np.uint8)
    if image.mode == 'LA' or (image.mode == 'P' and 'transparency' in image.info):
        image = image.convert('RGBA')
    elif image.mode == 'P':
        image = image.convert('RGB')
    elif image.mode == '1':
        image = image.convert('L')
    if image.mode not in ('L', 'RGB', 'RGBA'):
        raise ValueError(f'pixels of type {image.mode}; allowed: grey or colour of 8 or 16 bits')
    pixels = np.asarray(image)
    return pixels.reshape(pixels.shape[0], pixels.shape[1], -1)
