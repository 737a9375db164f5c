"""Real encoders on command lines."""

from __future__ import annotations

import argparse

ENCODERS_HELP = 'real encoders: amt102, pololu_25d, ... (files of config/encoders/; catalogue: all), or .yaml files'


def add_encoders(parser: argparse._ActionsContainer, option: str = '--encoders') -> None:
    """Add the option that names real encoders."""
    parser.add_argument(option, nargs='+', metavar='NAME|FILE', help=ENCODERS_HELP)
