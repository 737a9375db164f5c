"""rasterise_world: make a map for map_server directly from a .world file, without driving or SLAM."""

from __future__ import annotations

from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import RasterOptions
from diff_encoder_sim.base.command_line import user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.maps'  # imported by the command on demand
EXAMPLES = ['worlds/hallway.world --free -10 0 --out maps/hallway']
parse = partial(read_options, RasterOptions, name='rasterise_world', description=__doc__, examples=EXAMPLES)


@user_errors('rasterise_world')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.maps import map_of_world

    print(map_of_world(parse(arguments)))
