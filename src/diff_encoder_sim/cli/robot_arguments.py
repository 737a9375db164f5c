"""The robot on command lines: --robot and --robot-arg."""

from __future__ import annotations

import argparse

ROBOT_HELP = 'robot: a name (config/robots/), a robot file (.yaml), or a xacro or URDF file'


def add_robot_arguments(parser: argparse._ActionsContainer, *aliases: str, note: str = '') -> None:
    """Add --robot, under other names too, and --robot-arg; `note` is what the help says about the default."""
    parser.add_argument('--robot', *aliases, metavar='NAME|FILE', help=ROBOT_HELP + note)
    add_xacro_arguments(parser)


def add_xacro_arguments(parser: argparse._ActionsContainer) -> None:
    """Add --robot-arg."""
    parser.add_argument(
        '--robot-arg',
        metavar='NAME:=VALUE',
        action='append',
        default=[],
        dest='robot_args',
        help="argument of the robot's xacro; may be repeated",
    )
