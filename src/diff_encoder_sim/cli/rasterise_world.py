"""rasterise_world: makes a map file straight from a world file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import List, Optional, Sequence

from pydantic import Field

from diff_encoder_sim.base.console import run_tool
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.mapping.map_files import save_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world


class RasteriseParams(Params):
    """How a world is rasterised."""

    free: List[float] = Field(min_length=2, max_length=2, description='a point x, y [m]')
    height: float = Field(description='of the scan plane [m]')
    resolution: float = Field(ge=0.001, le=10, description='side of a cell [m]')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Entry point of the executable."""
    run_tool('rasterise_world', lambda: _rasterise(_parse(arguments)))


def _rasterise(options: argparse.Namespace) -> None:
    params = RasteriseParams.from_mapping(
        {'free': options.free, 'height': options.height, 'resolution': options.resolution}, 'arguments'
    )
    grid = rasterise(load_world(options.world), params.height, params.resolution, *params.free)
    print(save_map(grid, options.out or options.world.with_suffix('')))


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='rasterise_world', description=__doc__, epilog='example: rasterise_world worlds/hallway.world --free -10 0'
    )
    parser.add_argument('world', type=Path, help='.world file')
    parser.add_argument(
        '--free', type=float, nargs=2, default=[0.0, 0.0], metavar=('X', 'Y'), help='a point in free space [m]'
    )
    parser.add_argument('--height', type=float, default=1.12, help='of the scan plane [m]')
    parser.add_argument('--resolution', type=float, default=0.05, help='side of a cell [m]')
    parser.add_argument('--out', type=Path, help='path without suffix (default: beside the world)')
    return parser.parse_args(arguments)
