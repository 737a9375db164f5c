"""Options of reencode for drives without wheel angles, and which of them go together."""

from __future__ import annotations

import argparse
from pathlib import Path

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_robot import RecordedRobot
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.reencoding.csv_format import TIME_UNITS
from diff_encoder_sim.reencoding.wheel_units import SPEEDS, UNITS

# Options by the sources that they belong to.
_SOURCES = ('joint_states', 'pulses', 'ticks', 'odom', 'csv')
_BELONGS_TO = {
    'left': ('joint_states', 'pulses'),
    'right': ('joint_states', 'pulses'),
    'pulses_ppr': ('pulses', 'joint_states'),  # which may be found to be counts
    'unit': ('ticks', 'csv'),
    'ticks_per_revolution': ('ticks', 'csv'),
    'ticks_modulus': ('ticks', 'csv'),
    'reversed': ('ticks', 'csv'),
    'columns': ('csv',),
    'time_unit': ('csv',),
}


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


def check_wheel_options(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other.

    Raises:
        ConfigError: there is more than one source, or an option of another one.
    """
    given = [name for name in _SOURCES if getattr(options, name)]
    if len(given) > 1:
        all_of_them = 'both' if len(given) == 2 else 'all'
        raise ConfigError(f'{", ".join(map(_option, given))}: given {all_of_them}; allowed: one of them')
    if bool(options.bag) == bool(options.csv):
        raise ConfigError(f'BAG, --csv: given {"both" if options.csv else "neither"}; allowed: one of them')
    if options.csv and not options.columns:
        raise ConfigError('--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers')
    for name, sources in _BELONGS_TO.items():
        if getattr(options, name) not in (None, '', ()) and (given or ['joint_states'])[0] not in sources:
            used = _option(given[0]) if given else 'wheel angles of joints'
            allowed = ' or '.join(map(_option, sources))
            raise ConfigError(f'{_option(name)}: given with {used}; allowed: with {allowed}')


def check_seed(options: argparse.Namespace, robot: RecordedRobot) -> None:
    """Refuse a seed from which nothing is drawn: neither errors of an encoder, nor angles at the start.

    Raises:
        ConfigError: as said.
    """
    is_used = options.encoder or robot.draws_errors or options.odom or options.unit in SPEEDS
    if options.seed is not None and not is_used:
        raise ConfigError(
            f'--seed: given {options.seed}, but nothing is drawn from it; allowed: with --encoder, with errors of an '
            f'encoder in --config or --robot, with --odom, or with --unit {", ".join(SPEEDS)}'
        )


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'given {text}; allowed: a whole number from 0')
    return int(text)


def _modulus(text: str) -> int:
    try:
        return EncoderParams.from_mapping({'counter_modulus': int(text)}, '').counter_modulus
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'
