"""rasterise_world: a map of a .world file. Its help is in rasterise_world_arguments."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.cli.rasterise_world_arguments import parse
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('rasterise_world', lambda: _rasterise(parse(arguments)))


def _rasterise(options: argparse.Namespace) -> None:
    grid = rasterise(load_world(options.world), options.height, options.resolution, *options.free)
    print(save_map(grid, options.out or options.world.with_suffix('')))
