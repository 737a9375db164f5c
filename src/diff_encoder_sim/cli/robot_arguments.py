"""The robot on command lines: --robot, --robot-arg, --packages and --unchecked."""

from __future__ import annotations

import argparse
from pathlib import Path

ROBOT_HELP = 'robot: a name (config/robots/), a robot file (.yaml), or a xacro or URDF file'


def add_robot_arguments(parser: argparse._ActionsContainer, note: str = '') -> None:
    """Add --robot, --robot-arg and --packages; `note` on the default ends the help of --robot."""
    parser.add_argument('--robot', metavar='NAME|FILE', help=ROBOT_HELP + note)
    add_description_arguments(parser)


def add_description_arguments(parser: argparse._ActionsContainer) -> None:
    """Add --robot-arg and --packages."""
    parser.add_argument(
        '--robot-arg',
        metavar='NAME:=VALUE',
        action='append',
        default=[],
        dest='robot_args',
        help="argument of the robot's xacro; may be repeated",
    )
    parser.add_argument(
        '--packages',
        nargs='+',
        type=Path,
        default=[],
        metavar='DIR',
        help="folders with packages of the robot's package:// and $(find); its own package takes precedence over them",
    )


def add_unchecked(parser: argparse.ArgumentParser) -> None:
    """Add the option that lets trials begin in spite of the checks."""
    parser.add_argument(
        '--unchecked',
        action='store_true',
        help='run the trials also where the self-check of the robot fails, or a test is not for it',
    )
