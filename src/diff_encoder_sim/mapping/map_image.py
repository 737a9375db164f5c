"""The image of a map file: PGM or PNG, of any kind of pixel, as grey or colour of 8 bits."""
from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from diff_encoder_sim.errors import ConfigError

FORMATS = ('PPM', 'PNG')  # PPM is PIL's name for all of PGM's family


def read_image(path: Path) -> np.ndarray:
    """(rows, columns, channels) of 0 to 255: one of grey or three of colour, and maybe alpha.

    Raises:
        ConfigError: it cannot be read, or is larger than PIL's limit.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('error', Image.DecompressionBombWarning)
            with Image.open(path, formats=FORMATS) as image:
                return _pixels(image)
    except (Image.DecompressionBombWarning, Image.DecompressionBombError):
        raise ConfigError(f'{path}: image too large; allowed: at most '
                          f'{Image.MAX_IMAGE_PIXELS} pixels') from None
    except UnidentifiedImageError:
        raise ConfigError(f'{path}: not an image, or one without pixels; '
                          f'allowed: PGM or PNG') from None
    except Exception as error:  # of a torn image PIL complains in many types
        reason = getattr(error, 'strerror', None)
        if reason is None:
            reason = f'truncated or damaged ({" ".join(str(error).split()) or type(error).__name__})'
        raise ConfigError(f'{path}: cannot be read: {reason}') from None


def _pixels(image: Image.Image) -> np.ndarray:
    if image.mode.startswith('I'):  # of 16 bits
        return (np.asarray(image)[:, :, np.newaxis] // 257).astype(np.uint8)
    if 'transparency' in image.info:
        image = image.convert('RGBA')
    elif image.mode == 'P':
        image = image.convert('RGB')
    elif image.mode == '1':
        image = image.convert('L')
    if image.mode not in ('L', 'LA', 'RGB', 'RGBA'):
        raise ValueError(f'pixels of type {image.mode}; allowed: grey or colour of 8 or 16 bits')
    pixels = np.asarray(image)
    return pixels.reshape(pixels.shape[0], pixels.shape[1], -1)
