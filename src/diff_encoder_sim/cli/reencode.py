"""reencode: compute the odometry of a recorded drive with other encoders."""

from __future__ import annotations

import argparse
import collections
import logging
import sys
from pathlib import Path
from typing import Counter, Dict, Iterator, List, Optional, Sequence

from diff_encoder_sim.base.bounds import COUNTER_STATES, SEEDS
from diff_encoder_sim.base.command_line import as_called, tool_parser, user_errors, whole_number_within
from diff_encoder_sim.cli.arguments import add_encoders, add_robot_arguments
from diff_encoder_sim.drives.number_units import TIME_UNITS, UNITS

DESCRIPTION = """\
reencode: compute the odometry of a recorded drive with other encoders.

Reads wheel angles (sensor_msgs/JointState) or counts (diff_encoder_sim/EncoderPulse) from a bag, or other numbers of
its messages (--ticks), a table (--csv), or odometry (--odom). Computes /encoder_pulse, /odom and /tf for each PPR as
the live nodes publish them, and prints the error of each odometry against a reference."""

NOTES = """\
Recorded counts give the wheel angle to half a count. The result is exact at a PPR that divides the recorded one;
otherwise a fraction PPR / (4 x recorded PPR) of the samples is off by one count. A finer PPR is limited by the recorded
resolution. Counts of --pulses wrap at the counter_modulus of --config, --robot or the bag's trial; those of --ticks
wrap by the type of their field (int16, uint16, int32, uint32).

Messages without a header are stamped with the time of receipt. Wheels in two topics are paired at the stamps of the
left one. Speeds are integrated by the trapezoidal rule."""

EXAMPLES = [
    'drive.bag --ppr 40 90 1024 4096 --out what_if/',
    'drive.bag --encoder catalogue --ppr 90',
    'drive.bag --ticks /lwheel /rwheel --ticks-per-revolution 360 --ppr 40 90',
    'kobuki.bag --robot kobuki --ticks /mobile_base/sensors/core.left_encoder /mobile_base/sensors/core.right_encoder',
    'jackal.bag --ticks "/feedback.drivers[0].measured_travel" "/feedback.drivers[1].measured_travel" --unit rad',
    '--csv wheels.csv --columns time left right --time-unit us --unit m/s --ppr 40 90',
]


API = 'api.recorded_drives'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('reencode', DESCRIPTION, EXAMPLES, NOTES)
    parser.add_argument(
        'bag', type=Path, nargs='?', metavar='BAG', help='bag of ROS 1 (complete or truncated) or ROS 2'
    )
    parser.add_argument(
        '--ppr',
        nargs='+',
        default=(),
        metavar='PPR',
        help='ideal encoders, in pulses per wheel revolution: 90, or "{left: 90, right: 1024}" '
        "(default: the robot's own if its file has it, else 40 90 1024 4096)",
    )
    add_encoders(parser, '--encoder')
    parser.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help='write a bag for each encoder, and reencode.csv, into DIR (default: only print the table)',
    )
    _add_wheel_options(parser)
    _add_source_options(parser)
    parser.add_argument(
        '--reference',
        default='',
        metavar='TOPIC|FRAMES',
        help='poses to compare odometry with: a topic, or two frames of /tf as "map->base_link" (default: '
        '/world_pose if the bag has it, else the odometry of the finest PPR)',
    )
    parser.add_argument(
        '--config',
        type=Path,
        metavar='FILE',
        help="the robot's wheels, joints and counter, in place of config/config.yaml",
    )
    add_robot_arguments(parser, note=" (default: the wheels of the bag's trial, else those of config/config.yaml)")
    return parser.parse_args(arguments)


def _add_wheel_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('wheels, if the bag has several')
    for option, metavar, text in (
        ('--joint-states', 'TOPIC', "topic of wheel angles (default: the bag's only one)"),
        ('--left', 'JOINT', "left joint (default: the robot's, or the bag's only left wheel)"),
        ('--right', 'JOINT', "right joint (default: the robot's, or the bag's only right wheel)"),
        ('--pulses', 'TOPIC', 'topic of counts, used instead of wheel angles'),
        ('--pulses-ppr', 'PPR', 'PPR of these counts (default: that of the recorded trial)'),
    ):
        group.add_argument(option, default='', metavar=metavar, help=text)


def _add_source_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of drives without wheel angles."""
    group = parser.add_argument_group('wheels of a drive without wheel angles')
    group.add_argument(
        '--ticks',
        nargs=2,
        metavar=('LEFT', 'RIGHT'),
        help='numbers in the messages of the bag: a topic of std_msgs (Int16 ... Float64), an element of an array as '
        'TOPIC[0], or a field of any message that the bag defines as TOPIC.field.field[0]',
    )
    group.add_argument('--csv', type=Path, metavar='FILE', help='table in place of a bag; its delimiter is detected')
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
        help='unit of the numbers of --ticks or --csv: counts (ticks; ticks/message: counts since the previous '
        'message), angles, path of the wheel (m), or speeds (default: ticks)',
    )
    group.add_argument(
        '--ticks-per-revolution',
        default='',
        metavar='N',
        help='ticks per wheel revolution, or "{left: N, right: N}" (default: the --robot\'s ppr)',
    )
    group.add_argument(
        '--ticks-modulus',
        type=whole_number_within(COUNTER_STATES),
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
        help='last resort: compute wheel angles from poses: a topic of odometry, or two frames of /tf as '
        '"odom->base_link"',
    )
    group.add_argument(
        '--seed',
        type=whole_number_within(SEEDS),
        metavar='N',
        help="seed of encoder errors (default: the number of the bag's trial, else 0), and of the start angles of the "
        'wheels for --odom and speeds (default: 1)',
    )


@user_errors('reencode')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.recorded_drives import reencoding
    from diff_encoder_sim.api.wheel_options import DriveOptions

    handler, once = logging.StreamHandler(), OnceFilter()
    handler.addFilter(once)
    logging.basicConfig(format=f'{as_called("reencode")}: %(message)s', handlers=[handler])
    done = reencoding(DriveOptions(**vars(parse(arguments))))
    for line in (*once.left_out(), *done.notes):
        print(f'{as_called("reencode")}: {line}', file=sys.stderr)
    print(done.text)
    for file in done.files:
        print(file)


class OnceFilter(logging.Filter):
    """Pass the first warning of each kind, and count the others."""

    def __init__(self) -> None:
        super().__init__()
        self._texts: Dict[str, List[str]] = {}  # first and last text, by kind
        self._others: Counter[str] = collections.Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record is the first of its kind."""
        kind, text = record.msg, record.getMessage()
        is_first = kind not in self._texts
        first, last = self._texts.get(kind, (text, text))
        self._others[kind] += last != text
        self._texts[kind] = [first, text]
        return is_first

    def left_out(self) -> Iterator[str]:
        """Yield the number of suppressed warnings per kind; repeated equal warnings count once."""
        for kind, count in self._others.items():
            if count:
                yield f'{count} more such as "{self._texts[kind][0]}"'
