"""Real encoders on command lines: their choice, and what follows from datasheets and rates, which is printed once."""

from __future__ import annotations

import argparse
import sys
from typing import Iterable

from diff_encoder_sim.encoders.chosen_encoder import ChosenEncoder
from diff_encoder_sim.simulation.periods import JOINTS_RATE_HZ

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


def name_rates(command: str, rates_hz: Iterable[float]) -> None:
    """Print a line for each rate at which the simulator's encoders cannot report: they sample its joint states."""
    for rate_hz in dict.fromkeys(rates_hz):
        if rate_hz > JOINTS_RATE_HZ:
            given = f'rate: {rate_hz:g} Hz of reports'
            print(f'{command}: {given}, but joint states come at {JOINTS_RATE_HZ:g} Hz: so do reports', file=sys.stderr)
