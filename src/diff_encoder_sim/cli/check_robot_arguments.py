"""check_robot: find out about a robot from its URDF or xacro, and check that it drives in the simulation as it should.

Prints what was found, each value with its source, and the results of a drive on a flat floor: whether the robot moves
as its wheels turn, stands on them, has the torque, and where its laser is.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.cli.robot_arguments import ROBOT_HELP, add_description_arguments


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    examples = ['my_robot.urdf.xacro --write my_robot.yaml', 'burger']
    parser = tool_parser('check_robot', __doc__, examples)
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    add_description_arguments(parser)
    parser.add_argument(
        '--write', type=Path, metavar='FILE', help='write a robot file with what was found, for --robot and robot:='
    )
    return parser.parse_args(arguments)
