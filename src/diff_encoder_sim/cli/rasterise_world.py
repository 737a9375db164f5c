"""rasterise_world: make a map for map_server directly from a .world file, without driving or SLAM."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.bounds import PLACES, Between
from diff_encoder_sim.base.command_line import number_within, tool_parser, user_errors

API = 'api.maps'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('rasterise_world', __doc__, ['worlds/hallway.world --free -10 0 --out maps/hallway'])
    parser.add_argument('world', type=Path, metavar='WORLD', help='.world file (SDF, of primitives)')
    parser.add_argument(
        '--free',
        type=number_within(PLACES),
        nargs=2,
        default=[0.0, 0.0],
        metavar=('X', 'Y'),
        help='a point in free space, in metres; all space reachable from it is free in the map (default: 0 0)',
    )
    parser.add_argument(
        '--height',
        type=number_within(PLACES),
        default=1.12,
        metavar='M',
        help='height of the scan plane above the floor, in metres (default: %(default)s)',
    )
    parser.add_argument(
        '--resolution',
        type=number_within(Between(1e-3, 10.0, 'm')),
        default=0.05,
        metavar='M',
        help='side of a cell, in metres (default: %(default)s)',
    )
    written = 'write STEM.pgm and STEM.yaml (default: next to the world)'
    parser.add_argument('--out', type=Path, metavar='STEM', help=written)
    return parser.parse_args(arguments)


@user_errors('rasterise_world')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.maps import map_of_world

    print(map_of_world(**vars(parse(arguments))))
