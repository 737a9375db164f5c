"""check_robot: inspect a robot from its URDF or xacro, and check its simulated motion.

Prints the detected values with their sources, and the results of a drive on a flat floor: whether the motion agrees
with the wheels, whether the robot stands on them and has enough torque, and the position of its laser.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser, user_errors
from diff_encoder_sim.cli.arguments import ROBOT_HELP, add_description_arguments

API = 'api.robots'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    examples = ['my_robot.urdf.xacro --write my_robot.yaml', 'burger']
    parser = tool_parser('check_robot', __doc__, examples)
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    add_description_arguments(parser)
    written = 'write a robot file with the detected values, for --robot and robot:='
    parser.add_argument('--write', type=Path, metavar='FILE', help=written)
    return parser.parse_args(arguments)


@user_errors('check_robot')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.robots import inspect_robot

    inspect_robot(**vars(parse(arguments)), show=lambda text: print(text, flush=True))
