"""robot_description: print the URDF of a robot, for the parameter robot_description."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.cli.robot_arguments import ROBOT_HELP
from diff_encoder_sim.robots.display_urdf import display_urdf, without_root_inertia
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from diff_encoder_sim.robots.xacro_arguments import xacro_arguments, xacro_arguments_of_text
from diff_encoder_sim.robots.xacro_expansion import expand


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('robot_description', lambda: print(_urdf(_parse(arguments))))


def _urdf(options: argparse.Namespace) -> str:
    arguments = {**xacro_arguments_of_text(options.robot_args), **xacro_arguments(options.arguments, 'argument')}
    # roslaunch starts its commands in a folder of its own.
    users_folder = Path(os.environ.get('PWD', '.'))
    file = load_robot_file(options.robot, users_folder, package_folder(), arguments)
    if options.frames:
        setup = set_up_robot(file)
        return display_urdf(file.source, (setup.description.left.joint, setup.description.right.joint))
    return expand(without_root_inertia(file.source) if options.no_root_inertia else file.source)


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
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
