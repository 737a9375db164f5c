"""robot_settings: inspect a robot and print the resulting parameters of the nodes, as YAML.

The launch files set the parameter /robot_settings with this output.
"""

from __future__ import annotations

import argparse
import sys
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser, user_errors
from diff_encoder_sim.cli.arguments import ROBOT_HELP, add_launched_robot

API = 'api.robots'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('robot_settings', __doc__, ['burger config.ppr:=90', 'my_robot.yaml'])
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    parser.add_argument('values', nargs='*', metavar='FILE.KEY:=VALUE', help="a parameter, which overrides the robot's")
    parser.add_argument('--bag', default='', metavar='BAG', help="recorded drive, whose trial's number is the seed")
    parser.add_argument('--sim', default='', metavar='NAME', help='pybullet, if it simulates the wheels')
    add_launched_robot(parser)
    return parser.parse_args(arguments)


@user_errors('robot_settings')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    import yaml

    from diff_encoder_sim.api.robots import LaunchOptions, node_settings

    given = vars(parse(arguments))
    values, bag = given.pop('values'), given.pop('bag')
    settings, notes = node_settings(LaunchOptions(**given), values, bag)
    for note in notes:
        print(f'robot_settings: {note}', file=sys.stderr)
    print(yaml.safe_dump(settings, sort_keys=False))
