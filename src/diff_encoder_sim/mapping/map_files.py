"""Map files as map_server reads and map_saver writes them: a YAML file beside an image."""
from __future__ import annotations

from pathlib import Path
from typing import List, Literal, Union

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError
from pydantic import Field, model_validator

from diff_encoder_sim.config import Params, load_params
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.se2 import Pose2D

# What map_saver writes, and from which occupancy on.
FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205
SAVED_FREE_BELOW, SAVED_OCCUPIED_ABOVE = 25, 65


class MapFileParams(Params):
    """The YAML file of a map: the keys of map_server."""

    image: str = Field(min_length=1, description='PGM or PNG; relative to the YAML file')
    resolution: float = Field(gt=0, description='side of a pixel [m]')
    origin: List[float] = Field(min_length=3, max_length=3,
                                description='pose of the lower left corner: x, y [m], yaw [rad]')
    negate: Literal[0, 1, False, True] = 0
    occupied_thresh: float = Field(0.65, ge=0, le=1)
    free_thresh: float = Field(0.196, ge=0, le=1)
    mode: Literal['trinary', 'scale', 'raw'] = 'trinary'

    @model_validator(mode='after')
    def _check_thresholds(self) -> MapFileParams:
        if self.free_thresh >= self.occupied_thresh:
            raise ValueError('free_thresh below occupied_thresh')
        return self


def load_map(path: Union[str, Path]) -> OccupancyGrid:
    """Read a map by its YAML file.

    Raises:
        ConfigError: one of the two files cannot be read, or holds a bad value.
    """
    params = load_params(MapFileParams, path)
    pixels = _read_image(Path(path).parent / params.image)
    cells = _raw_cells(pixels) if params.mode == 'raw' else _cells(pixels, params)
    # Images have their first row on top, grids at the bottom.
    return OccupancyGrid(np.ascontiguousarray(cells[::-1]), params.resolution,
                         Pose2D(*params.origin))


def save_map(grid: OccupancyGrid, stem: Union[str, Path]) -> Path:
    """Write STEM.pgm and STEM.yaml as map_saver does; returns the YAML file's path.

    Raises:
        ConfigError: the folder cannot be written to.
    """
    stem = Path(stem)
    cells = grid.cells[::-1]
    pixels = np.full(cells.shape, UNKNOWN_GREY, dtype=np.uint8)
    pixels[(cells >= 0) & (cells < SAVED_FREE_BELOW)] = FREE_GREY
    pixels[cells > SAVED_OCCUPIED_ABOVE] = OCCUPIED_GREY
    params = MapFileParams(image=f'{stem.name}.pgm', resolution=grid.resolution_m,
                           origin=[float(part) for part in grid.origin])
    yaml_path = stem.parent / f'{stem.name}.yaml'
    try:
        Image.fromarray(pixels).save(stem.parent / params.image)
        yaml_path.write_text(yaml.safe_dump(params.model_dump(), sort_keys=False))
    except OSError as error:
        raise ConfigError(f'{stem.parent}: cannot be written to: {error.strerror}') from None
    return yaml_path


def _read_image(path: Path) -> np.ndarray:
    """(rows, columns, channels) of 0 to 255."""
    try:
        with Image.open(path) as image:
            if image.mode not in ('L', 'LA', 'RGB', 'RGBA'):
                image = image.convert('RGBA' if 'transparency' in image.info else 'L')
            pixels = np.asarray(image)
    except UnidentifiedImageError:
        raise ConfigError(f'{path}: not an image; allowed: PGM or PNG') from None
    except (OSError, ValueError, SyntaxError) as error:
        reason = getattr(error, 'strerror', None) or error
        raise ConfigError(f'{path}: cannot be read: {reason}') from None
    return pixels.reshape(pixels.shape[0], pixels.shape[1], -1)


def _raw_cells(pixels: np.ndarray) -> np.ndarray:
    """Grey values as they are: 0 to 100 occupancy, anything above unknown."""
    grey = pixels.mean(axis=2)
    return np.where(grey <= OCCUPIED, grey, UNKNOWN).astype(np.int8)


def _cells(pixels: np.ndarray, params: MapFileParams) -> np.ndarray:
    has_alpha = pixels.shape[2] in (2, 4)
    scale = params.mode == 'scale'
    # In scale mode alpha says which pixels are known; in trinary it is one more channel.
    grey = (pixels[:, :, :-1] if has_alpha and scale else pixels).mean(axis=2)
    occupancy = (grey if params.negate else 255.0 - grey) / 255.0
    between = (occupancy - params.free_thresh) / (params.occupied_thresh - params.free_thresh)
    cells = 1 + 98 * between if scale else np.full(grey.shape, float(UNKNOWN))
    if has_alpha and scale:
        cells = np.where(pixels[:, :, -1] == 0, UNKNOWN, cells)
    cells = np.where(occupancy < params.free_thresh, FREE, cells)
    return np.where(occupancy > params.occupied_thresh, OCCUPIED, cells).astype(np.int8)
