"""The options of commands that launch files call: the robot's arguments and encoder, and YAML files."""

from __future__ import annotations

import argparse

# The launch arguments with YAML files, by the stems of the package's files.
FILE_OPTIONS = {
    'config': '--config',
    'simulator': '--simulator-config',
    'amcl': '--amcl-config',
    'navigation': '--navigation-config',
    'slam': '--slam-config',
}


def add_launched_robot(parser: argparse.ArgumentParser) -> None:
    """Add the options of `launched_robot` but the robot itself."""
    parser.add_argument('--robot-args', default='', metavar='TEXT', help='xacro arguments: name=value name=value')
    parser.add_argument('--encoder', default='', metavar='NAME|FILE', help='real encoder, in place of ppr')
    for stem, option in FILE_OPTIONS.items():
        parser.add_argument(option, metavar='FILE', help=f'in place of config/{stem}.yaml')
