"""robot_description: print the URDF that a xacro file expands to, for the parameter robot_description."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.simulation.robot import expand_xacro


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('robot_description', lambda: _print_urdf(_parse(arguments)))


def _print_urdf(options: argparse.Namespace) -> None:
    pairs = [argument.partition(':=') for argument in options.arguments]
    for name, separator, value in pairs:
        if not (name and separator):
            raise ConfigError(f'argument: given {name + value!r}; allowed: name:=value')
    print(expand_xacro(options.file, {name: value for name, _, value in pairs}))


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = tool_parser(
        'robot_description', __doc__, ['urdf/alto.urdf.xacro', 'urdf/alto.urdf.xacro lidar_noise:=0.01']
    )
    parser.add_argument('file', metavar='FILE', help='.xacro or .urdf file')
    parser.add_argument('arguments', nargs='*', metavar='NAME:=VALUE', help='xacro arguments')
    return parser.parse_args(arguments)
