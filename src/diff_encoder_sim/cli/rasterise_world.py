"""rasterise_world: make a map, as map_server reads it, directly from a .world file, without driving or SLAM."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import List, Optional, Sequence

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between, Place_m
from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.mapping.map_files import save_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world


class RasteriseParams(Params):
    """Where and how finely a world is cut."""

    free: List[Place_m] = Field(min_length=2, max_length=2, description='a point x, y in free space [m]')
    height: Place_m = Field(description='of the scan plane above the floor [m]')
    resolution: Annotated[float, Between(1e-3, 10.0, 'm')] = Field(description='side of a cell [m]')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('rasterise_world', lambda: _rasterise(_parse(arguments)))


def _rasterise(options: argparse.Namespace) -> None:
    params = RasteriseParams.from_mapping(
        {'free': options.free, 'height': options.height, 'resolution': options.resolution}, 'arguments'
    )
    grid = rasterise(load_world(options.world), params.height, params.resolution, *params.free)
    print(save_map(grid, options.out or options.world.with_suffix('')))


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = tool_parser('rasterise_world', __doc__, ['worlds/hallway.world --free -10 0 --out maps/hallway'])
    parser.add_argument('world', type=Path, metavar='WORLD', help='.world file (SDF, of primitives)')
    parser.add_argument(
        '--free',
        type=float,
        nargs=2,
        default=[0.0, 0.0],
        metavar=('X', 'Y'),
        help='a point in free space, in metres; all that can be reached from it is free on the map (default: 0 0)',
    )
    parser.add_argument(
        '--height',
        type=float,
        default=1.12,
        metavar='M',
        help='height of the scan plane above the floor, in metres (default: %(default)s)',
    )
    parser.add_argument(
        '--resolution', type=float, default=0.05, metavar='M', help='side of a cell, in metres (default: %(default)s)'
    )
    parser.add_argument(
        '--out', type=Path, metavar='STEM', help='write STEM.pgm and STEM.yaml (default: beside the world)'
    )
    return parser.parse_args(arguments)
