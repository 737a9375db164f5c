"""The command line of reencode."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.cli.encoder_arguments import add_encoders
from diff_encoder_sim.cli.reencode_source_arguments import add_source_options
from diff_encoder_sim.cli.robot_arguments import add_robot_arguments

CSV_NAME = 'reencode.csv'
PAPER_PPR = ('40', '90', '1024', '4096')

DESCRIPTION = """\
reencode: compute what a recorded drive's odometry would have been with other encoders.

Reads wheel angles (sensor_msgs/JointState) or counts (diff_encoder_sim/EncoderPulse) from a bag; where it has neither,
any numbers of its messages (--ticks), a table (--csv), or odometry (--odom). Computes /encoder_pulse, /odom and /tf for
each PPR as the live nodes would have published them, and prints how far each odometry is from a reference."""

NOTES = """\
From recorded counts the wheel angle is known to half a count. At a PPR that divides the recorded encoder's the
result is exact; at another, in a fraction of PPR / (4 x recorded PPR) of the samples a count is one off. A finer PPR
shows no more than the recorded counts do. Counts of --pulses wrap at the counter_modulus of --config, --robot or the
bag's trial; those of --ticks wrap where the type of their field does (int16, uint16, int32, uint32).

Messages without a header are stamped with the time of their receipt. Wheels that come in two topics are paired at the
left one's stamps. Speeds are integrated by the trapezoidal rule."""

EXAMPLES = [
    'drive.bag --ppr 40 90 1024 4096 --out what_if/',
    'drive.bag --encoder catalogue --ppr 90',
    'drive.bag --ticks /lwheel /rwheel --ticks-per-revolution 360 --ppr 40 90',
    'kobuki.bag --robot kobuki --ticks /mobile_base/sensors/core.left_encoder /mobile_base/sensors/core.right_encoder',
    'jackal.bag --ticks "/feedback.drivers[0].measured_travel" "/feedback.drivers[1].measured_travel" --unit rad',
    '--csv wheels.csv --columns time left right --time-unit us --unit m/s --ppr 40 90',
]


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('reencode', DESCRIPTION, EXAMPLES, NOTES)
    parser.add_argument(
        'bag', type=Path, nargs='?', metavar='BAG', help='bag of ROS 1 (complete, or torn by a crash) or ROS 2'
    )
    parser.add_argument(
        '--ppr',
        nargs='+',
        metavar='PPR',
        help='ideal encoders, in pulses per wheel revolution: 90, or "{left: 90, right: 1024}" '
        f"(default: the robot's own where its file says it, else {' '.join(PAPER_PPR)})",
    )
    add_encoders(parser, '--encoder')
    parser.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help=f'write a bag for each encoder, and {CSV_NAME}, into DIR (default: only print the table)',
    )
    _add_wheel_options(parser)
    add_source_options(parser)
    parser.add_argument(
        '--reference',
        default='',
        metavar='TOPIC|FRAMES',
        help='poses to compare odometry with: a topic, or two frames of /tf as "map->base_link" (default: '
        '/world_pose where the bag has it, else the odometry of the finest PPR)',
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
    group = parser.add_argument_group('wheels, where the bag leaves a choice')
    for option, metavar, text in (
        ('--joint-states', 'TOPIC', "topic of wheel angles (default: the bag's only one)"),
        ('--left', 'JOINT', "left joint (default: the robot's, or the bag's only left wheel)"),
        ('--right', 'JOINT', "right joint (default: the robot's, or the bag's only right wheel)"),
        ('--pulses', 'TOPIC', 'topic of counts, to be used instead of wheel angles'),
        ('--pulses-ppr', 'PPR', 'PPR of the encoder that counted them (default: that of the recorded trial)'),
    ):
        group.add_argument(option, default='', metavar=metavar, help=text)
