"""Arguments shared by commands."""

from __future__ import annotations

import argparse
from pathlib import Path

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import whole_number_within


def add_amcl(parser: argparse._ActionsContainer) -> None:
    """Add --amcl."""
    parser.add_argument(
        '--amcl',
        metavar='NAME|FILE',
        help="AMCL's parameters: amcl (the paper's) or amcl_accurate (files of config/), or a .yaml file",
    )


ENCODERS_HELP = 'real encoders: amt102, pololu_25d, ... (files of config/encoders/; catalogue: all), or .yaml files'


def add_encoders(parser: argparse._ActionsContainer, option: str = '--encoders') -> None:
    """Add the option for real encoders."""
    parser.add_argument(option, nargs='+', metavar='NAME|FILE', help=ENCODERS_HELP)


ROBOT_HELP = 'robot: a name (config/robots/), a robot file (.yaml), or a xacro or URDF file'


def add_robot_arguments(parser: argparse._ActionsContainer, note: str = '') -> None:
    """Add --robot, --robot-arg and --packages; `note` is appended to the help of --robot."""
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
    """Add the option that skips the checks."""
    parser.add_argument(
        '--unchecked',
        action='store_true',
        help='run even if the robot self-check fails, or the robot does not fit a test',
    )


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add the options that select the workers."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        '--workers',
        type=whole_number_within(Between(1, 1024)),
        metavar='N',
        help='worker processes on this host (default: one for each core)',
    )
    where.add_argument(
        '--scheduler',
        metavar='ADDRESS',
        help='run on a Dask cluster: its scheduler, such as tcp://host:8786 (docs/campaigns.md)',
    )
    tls = parser.add_argument_group('TLS options for --scheduler: PEM files')
    tls.add_argument('--tls-ca', type=Path, metavar='FILE', help='certificate of the certificate authority')
    tls.add_argument('--tls-cert', type=Path, metavar='FILE', help='certificate of this process')
    tls.add_argument('--tls-key', type=Path, metavar='FILE', help='its key (default: in the file of --tls-cert)')


# Launch arguments for YAML files, by stem of the package's file.
FILE_OPTIONS = {
    'config': '--config',
    'simulator': '--simulator-config',
    'amcl': '--amcl-config',
    'navigation': '--navigation-config',
    'slam': '--slam-config',
}


def add_launched_robot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `launched_robot`, except the robot."""
    parser.add_argument('--robot-args', default='', metavar='TEXT', help='xacro arguments: name=value name=value')
    parser.add_argument('--encoder', default='', metavar='NAME|FILE', help='real encoder, in place of ppr')
    for stem, option in FILE_OPTIONS.items():
        parser.add_argument(option, metavar='FILE', help=f'in place of config/{stem}.yaml')
