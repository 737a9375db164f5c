"""The command line of map_saver."""

from __future__ import annotations

import argparse
from pathlib import Path

from diff_encoder_sim.base.bounds import PERCENT
from diff_encoder_sim.base.command_line import tool_parser, whole_number_within
from diff_encoder_sim.ros.own_words import own_words

DESCRIPTION = """\
map_saver: save the map that is published on /map to an image and a YAML file, as upstream's map_saver does."""


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('map_saver', DESCRIPTION, ['-f ~/maps/office', '-f office map:=/my_map'])
    parser.add_argument(
        '-f',
        dest='stem',
        type=Path,
        default=Path('map'),
        metavar='STEM',
        help='write STEM.pgm and STEM.yaml (default: %(default)s)',
    )
    parser.add_argument(
        '--occ',
        type=whole_number_within(PERCENT),
        default=65,
        metavar='PERCENT',
        help='a cell of this occupancy or more is saved as occupied (default: %(default)s)',
    )
    parser.add_argument(
        '--free',
        type=whole_number_within(PERCENT),
        default=25,
        metavar='PERCENT',
        help='a cell of this occupancy or less is saved as free (default: %(default)s)',
    )
    return parser.parse_args(own_words())
