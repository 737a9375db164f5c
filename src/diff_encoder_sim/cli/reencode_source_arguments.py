"""Options of reencode for drives without wheel angles."""

from __future__ import annotations

import argparse
from pathlib import Path

from diff_encoder_sim.base.bounds import COUNTER_STATES
from diff_encoder_sim.base.text_values import plain_int
from diff_encoder_sim.drives.csv_format import TIME_UNITS
from diff_encoder_sim.drives.number_units import UNITS


def add_source_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of drives without wheel angles."""
    group = parser.add_argument_group('wheels of a drive without wheel angles')
    group.add_argument(
        '--ticks',
        nargs=2,
        metavar=('LEFT', 'RIGHT'),
        help='numbers in the messages of the bag: a topic of std_msgs (Int16 ... Float64), an element of an array as '
        'TOPIC[0], or a field of any message that the bag defines as TOPIC.field.field[0]',
    )
    group.add_argument('--csv', type=Path, metavar='FILE', help='table in place of a bag; its delimiter is found')
    group.add_argument(
        '--columns',
        nargs=3,
        default=(),
        metavar=('TIME', 'LEFT', 'RIGHT'),
        help='columns of the table: names in its header, or numbers from 1',
    )
    group.add_argument('--time-unit', choices=TIME_UNITS, default='', help='unit of the time column (default: s)')
    group.add_argument(
        '--unit',
        choices=UNITS,
        default='',
        help='what the numbers of --ticks or --csv are: counts (ticks; ticks/message where each message has what was '
        'counted since the one before), angles, path of the wheel (m), or speeds (default: ticks)',
    )
    group.add_argument(
        '--ticks-per-revolution',
        default='',
        metavar='N',
        help='ticks of a whole turn of the wheel, or "{left: N, right: N}" (default: the --robot\'s ppr)',
    )
    group.add_argument(
        '--ticks-modulus',
        type=_modulus,
        metavar='N',
        help='counts before the recorded counter wraps, 0 for never (default: by the type of the field, 65536 for 16 '
        'bits; of a table: 0)',
    )
    group.add_argument(
        '--reversed',
        nargs='+',
        choices=('left', 'right'),
        default=(),
        help='wheels whose numbers fall when the robot drives forward',
    )
    group.add_argument(
        '--odom',
        default='',
        metavar='TOPIC|FRAMES',
        help='last resort: compute how the wheels have turned from poses: a topic of odometry, or two frames of /tf as '
        '"odom->base_link"',
    )
    group.add_argument(
        '--seed',
        type=_seed,
        metavar='N',
        help="of the encoders' errors (default: the number of the bag's trial, else 0); and of the wheels' angles "
        'at the start, which --odom and speeds do not have (default: 1)',
    )


def _seed(text: str) -> int:
    try:
        value = plain_int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f'given {text}; allowed: a whole number from 0')
    return value


def _modulus(text: str) -> int:
    try:
        value = plain_int(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if not COUNTER_STATES.allows(value):
        raise argparse.ArgumentTypeError(f'counter_modulus: given {value}; allowed: {COUNTER_STATES}')
    return value
