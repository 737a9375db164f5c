"""The robot on command lines: --robot and --robot-arg, and the same in one text as launch files pass it."""

from __future__ import annotations

import argparse
import shlex
from typing import Dict, Sequence

from diff_encoder_sim.base.errors import ConfigError

DEFAULT_ROBOT = 'alto'
ROBOT_HELP = 'robot: a name (config/robots/), a robot file (.yaml), or a xacro or URDF file'


def add_robot_arguments(parser: argparse._ActionsContainer, default: str = '', note: str = '') -> None:
    """Add --robot and --robot-arg; `note` is what the help says about the default."""
    parser.add_argument('--robot', metavar='NAME|FILE', default=default or None, help=ROBOT_HELP + note)
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


def xacro_arguments(words: Sequence[str], where: str = '--robot-arg') -> Dict[str, str]:
    """Read arguments of a xacro.

    Raises:
        ConfigError: one is not NAME:=VALUE, or a name comes twice.
    """
    arguments: Dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not (name and separator):
            raise ConfigError(f'{where}: given {word!r}; allowed: name:=value')
        if name in arguments:
            raise ConfigError(f'{where}: given {name!r} twice; allowed: once')
        arguments[name] = value
    return arguments


def xacro_arguments_of_text(text: str) -> Dict[str, str]:
    """Read the launch argument robot_args.

    Raises:
        ConfigError: it is not NAME:=VALUE, separated by blanks.
    """
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ConfigError(f'robot_args: given {text!r}: {error}; allowed: name:=value name:=value') from None
    return xacro_arguments(words, 'robot_args')
