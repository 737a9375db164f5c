"""rasterise_world: a map of a .world file. Its help is in rasterise_world_arguments."""

from __future__ import annotations

import argparse
from typing import List, Optional, Sequence

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between, Place_m
from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.cli.rasterise_world_arguments import parse
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
    run_tool('rasterise_world', lambda: _rasterise(parse(arguments)))


def _rasterise(options: argparse.Namespace) -> None:
    params = RasteriseParams.from_mapping(
        {'free': options.free, 'height': options.height, 'resolution': options.resolution}, 'arguments'
    )
    grid = rasterise(load_world(options.world), params.height, params.resolution, *params.free)
    print(save_map(grid, options.out or options.world.with_suffix('')))
