"""Real encoders on command lines: their choice, and what follows from their datasheets, which is printed once."""

from __future__ import annotations

import argparse
import sys
from typing import Iterable

from diff_encoder_sim.encoders.chosen_encoder import ChosenEncoder

ENCODERS_HELP = 'real encoders: amt102, pololu_25d, ... (files of config/encoders/; catalogue: all), or .yaml files'


def add_encoders(parser: argparse._ActionsContainer, option: str = '--encoders') -> None:
    """Add the option that names real encoders."""
    parser.add_argument(option, nargs='+', metavar='NAME|FILE', help=ENCODERS_HELP)


def name_encoders(command: str, encoders: Iterable[ChosenEncoder], wheel_diameter_m: float) -> None:
    """Print a line for each encoder with a resolution: what its counts follow from, and how many are on a metre."""
    for encoder in encoders:
        if encoder.resolution:
            name = f'{encoder.name} ({encoder.real.name})' if encoder.real else 'encoder'
            per_metre = f'{encoder.counts_per_metre(wheel_diameter_m):.5g} per metre'
            print(f'{command}: {name}: {encoder.resolution}, {per_metre}', file=sys.stderr)
