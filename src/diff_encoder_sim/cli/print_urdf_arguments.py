"""robot_description: print the URDF of a robot, for the parameter robot_description."""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.cli.robot_arguments import ROBOT_HELP


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('robot_description', __doc__, ['burger', 'my_robot.urdf.xacro scale:=2 --frames'])
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    parser.add_argument('arguments', nargs='*', metavar='NAME:=VALUE', help="arguments of the robot's xacro")
    parser.add_argument('--robot-args', default='', metavar='TEXT', help='more of them, in one text')
    parser.add_argument(
        '--frames',
        action='store_true',
        help='for robot_state_publisher: joints other than the driven wheels are fixed, the root link has no inertia',
    )
    parser.add_argument(
        '--no-root-inertia', action='store_true', help='root_inertia:=false, where the xacro has this argument'
    )
    return parser.parse_args(arguments)
