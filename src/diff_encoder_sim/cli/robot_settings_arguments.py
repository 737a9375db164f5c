"""robot_settings: find out about a robot and print the parameters of the nodes that follow, as YAML.

The launch files put them into the parameter /robot_settings, where the nodes read them.
"""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.cli.launch_arguments import add_launched_robot
from diff_encoder_sim.cli.robot_arguments import ROBOT_HELP


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('robot_settings', __doc__, ['burger config.ppr:=90', 'my_robot.yaml'])
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    parser.add_argument('values', nargs='*', metavar='FILE.KEY:=VALUE', help="a parameter, before the robot's own")
    parser.add_argument('--bag', default='', metavar='BAG', help="recorded drive, whose trial's number is the seed")
    parser.add_argument('--sim', default='', metavar='NAME', help='pybullet, where it simulates the wheels')
    add_launched_robot(parser)
    return parser.parse_args(arguments)
