"""Real encoders on command lines: their choice, and what follows from their datasheets, which is printed once."""

from __future__ import annotations

import argparse
import sys
from typing import Iterable

from diff_encoder_sim.base.command_name import as_called
from diff_encoder_sim.encoders.chosen_encoder import ChosenEncoder

ENCODERS_HELP = 'real encoders: amt102, pololu_25d, ... (files of config/encoders/; catalogue: all), or .yaml files'


def add_encoders(parser: argparse._ActionsContainer) -> None:
    """Add --encoders."""
    parser.add_argument('--encoders', nargs='+', metavar='NAME|FILE', help=ENCODERS_HELP)


def name_encoders(command: str, encoders: Iterable[ChosenEncoder], wheel_diameter_m: float) -> None:
    """Print a line for each real encoder: what its counts follow from, and how many they are on a metre."""
    for encoder in encoders:
        if encoder.real:
            per_metre = f'{encoder.counts_per_metre(wheel_diameter_m):.5g} per metre'
            line = f'{encoder.name} ({encoder.real.name}): {encoder.resolution}, {per_metre}'
            print(f'{as_called(command)}: {line}', file=sys.stderr)
