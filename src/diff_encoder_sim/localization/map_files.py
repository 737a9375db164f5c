"""Read and write map files as map_server and map_saver do: a YAML file next to an image."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, List, Literal, Optional, Union

import numpy as np
import yaml
from PIL import Image
from pydantic import Field, field_validator, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.bounds import Between, CellSide_m, Fraction, Percent
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.params import Line, Params, load_params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid

FORMATS = ('PPM', 'PNG')  # PPM is PIL's name for all of PGM's family
# A PNG of 40 kB may have as many pixels, which take up to 0.6 GB: a square of 290 m in cells of 5 cm.
LARGEST_IMAGE = 1 << 25


def read_image(path: Path) -> np.ndarray:
    """Return pixels (rows, columns, channels) uint8: one channel of grey, three of colour or four with alpha, as SDL.

    Raises ConfigError if the image cannot be read, or has more than `LARGEST_IMAGE` pixels.
    """
    try:
        with Image.open(path, formats=FORMATS) as image:
            if image.width * image.height > LARGEST_IMAGE:
                raise ValueError(f'more than {LARGEST_IMAGE} pixels')
            if image.mode.startswith('I'):  # 16 bits: the upper 8, as SDL
                return (np.asarray(image)[:, :, np.newaxis] >> 8).astype(np.uint8)
            has_alpha = image.mode in ('LA', 'RGBA') or (image.mode == 'P' and 'transparency' in image.info)
            is_grey = image.mode in ('1', 'L')
            pixels = np.asarray(image.convert('RGBA' if has_alpha else 'L' if is_grey else 'RGB'))
            return pixels.reshape(image.height, image.width, -1)
    except Exception as error:  # PIL raises many types for a damaged image
        reason = getattr(error, 'strerror', None) or in_one_line(error)
        raise ConfigError(f'{path}: cannot be read as a PGM or PNG image: {reason}') from None


FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205  # map_saver's pixel values
ORIGIN_DIGITS = 9  # in a saved file: nanometres, so that a yaw sent as a quaternion comes back equal


class MapFileParams(Params):
    """Keys of map_server's YAML file."""

    image: Line = Field(min_length=1, description='PGM or PNG; relative to the YAML file')
    resolution: CellSide_m = Field(description='side of a pixel [m]')
    origin: List[Annotated[float, Between(-1e6, 1e6)]] = Field(
        min_length=3, max_length=3, description='pose of the lower left corner: x, y [m], yaw [rad]'
    )
    negate: Literal[0, 1, False, True] = 0
    occupied_thresh: Fraction = Field(0.65)
    free_thresh: Fraction = Field(0.196)
    mode: Literal['trinary', 'scale', 'raw'] = 'trinary'

    @field_validator('resolution', 'origin', 'occupied_thresh', 'free_thresh', mode='before')
    @classmethod
    def _read_numbers(cls, value: Any) -> Any:
        """Accept 5e-2 and "0.05", which are text to PyYAML and numbers to map_server's parser."""
        if isinstance(value, list):
            return [cls._read_numbers(part) for part in value]
        try:
            return float(value) if isinstance(value, str) else value
        except ValueError:
            return value

    @model_validator(mode='after')
    def _check_thresholds(self) -> MapFileParams:
        if self.free_thresh >= self.occupied_thresh:
            raise ValueError('free_thresh below occupied_thresh')
        return self


class MapSaverParams(Params):
    """Options of map_saver: the occupancies that are saved as free and as occupied."""

    free: Percent = Field(25, description='highest occupancy of a free cell [%]')
    occ: Annotated[int, Between(1, 100, '%')] = Field(65, description='lowest occupancy of an occupied cell [%]')

    @model_validator(mode='after')
    def _check_order(self) -> MapSaverParams:
        if self.free >= self.occ:
            raise ValueError('free below occ')
        return self


def load_map(path: Union[str, Path]) -> OccupancyGrid:
    """Read a map and its image by the path of the YAML file; raise ConfigError if one is unreadable or invalid."""
    params = load_params(MapFileParams, path)
    cells = _cells(read_image(Path(path).parent / params.image), params)
    # The first row of an image is its top, that of a grid its bottom.
    return OccupancyGrid(np.ascontiguousarray(cells[::-1]), params.resolution, Pose2D(*params.origin))


def save_map(grid: OccupancyGrid, stem: Union[str, Path], params: Optional[MapSaverParams] = None) -> Path:
    """Write STEM.pgm and STEM.yaml as map_saver, each atomically, and missing folders; ConfigError if it fails."""
    stem, params = Path(stem), params or MapSaverParams()
    origin = [round(float(part), ORIGIN_DIGITS) for part in grid.origin]
    values = {'image': f'{stem.name}.pgm', 'resolution': grid.resolution_m, 'origin': origin}
    description = MapFileParams.from_mapping(values, str(stem)).model_dump()
    pixels = np.full(grid.cells.shape, UNKNOWN_GREY, dtype=np.uint8)
    pixels[(grid.cells >= 0) & (grid.cells <= params.free)] = FREE_GREY
    pixels[grid.cells >= params.occ] = OCCUPIED_GREY
    image = io.BytesIO()
    Image.fromarray(pixels[::-1]).save(image, format='PPM')
    _write(stem.parent / f'{stem.name}.pgm', image.getvalue())
    return _write(stem.parent / f'{stem.name}.yaml', yaml.safe_dump(description, sort_keys=False).encode('utf-8'))


def _write(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content)
    except OSError as error:
        raise ConfigError(f'{path}: cannot be written: {error.strerror or error}') from None
    return path


def _cells(pixels: np.ndarray, params: MapFileParams) -> np.ndarray:
    """Return the cells (rows, columns) int8 of an image, the first row on top; alpha counts as in map_server."""
    has_alpha = pixels.shape[2] == 4
    colours = pixels[:, :, :-1] if has_alpha and params.mode != 'trinary' else pixels
    # A table over all possible sums of channels avoids float arrays as large as the image.
    sums: np.ndarray = colours.sum(axis=2, dtype=np.uint16)
    grey = np.arange(255 * colours.shape[2] + 1) / colours.shape[2]
    grey = 255.0 - grey if params.negate else grey
    occupancy = (255.0 - grey) / 255.0
    is_free, is_occupied = occupancy < params.free_thresh, occupancy > params.occupied_thresh
    table = trinary = np.select([is_free, is_occupied], [FREE, OCCUPIED], UNKNOWN).astype(np.int8)
    if params.mode == 'raw':  # occupancy as it is; anything above 100 is unknown
        table = np.where(np.floor(grey) <= OCCUPIED, grey, UNKNOWN).astype(np.int8)
    elif params.mode == 'scale':
        between = (occupancy - params.free_thresh) / (params.occupied_thresh - params.free_thresh)
        table = np.select([is_free, is_occupied], [FREE, OCCUPIED], 1 + 98 * between).astype(np.int8)
    cells: np.ndarray = table[sums]
    if has_alpha and params.mode == 'scale':
        cells = np.where(pixels[:, :, -1] == 0, trinary[sums], cells)
    return cells
