"""robot_description: print the URDF of a robot, for the parameter robot_description."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser, user_errors
from diff_encoder_sim.cli.arguments import ROBOT_HELP

API = 'api.robots'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('robot_description', __doc__, ['burger', 'my_robot.urdf.xacro scale:=2 --frames'])
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    parser.add_argument('arguments', nargs='*', metavar='NAME:=VALUE', help="arguments of the robot's xacro")
    parser.add_argument('--robot-args', default='', metavar='TEXT', help='further xacro arguments, as one string')
    parser.add_argument(
        '--frames',
        action='store_true',
        help='for robot_state_publisher: joints other than the driven wheels are fixed, the root link has no inertia',
    )
    parser.add_argument(
        '--no-root-inertia', action='store_true', help='root_inertia:=false, if the xacro has this argument'
    )
    return parser.parse_args(arguments)


@user_errors('robot_description')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.robots import LaunchOptions, robot_urdf

    options = parse(arguments)
    robot = LaunchOptions(options.robot, options.robot_args)
    print(robot_urdf(robot, options.arguments, options.frames, options.no_root_inertia))
