"""robot_description: prints the URDF of a xacro file, with xacro's arguments name:=value."""

from __future__ import annotations

import argparse

from diff_encoder_sim.base.console import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.simulation.robot import expand_xacro


def main() -> None:
    """Entry point of the executable."""
    run_tool('robot_description', _print_urdf)


def _print_urdf() -> None:
    parser = argparse.ArgumentParser(
        prog='robot_description',
        description=__doc__,
        epilog='example: robot_description urdf/alto.urdf.xacro root_inertia:=false',
    )
    parser.add_argument('file', help='.xacro or .urdf file')
    parser.add_argument('arguments', nargs='*', metavar='name:=value', help='xacro arguments')
    options = parser.parse_args()
    pairs = [argument.partition(':=') for argument in options.arguments]
    for name, separator, value in pairs:
        if not (name and separator):
            raise ConfigError(f'argument: given {name + value!r}; allowed: name:=value')
    print(expand_xacro(options.file, {name: value for name, _, value in pairs}))
