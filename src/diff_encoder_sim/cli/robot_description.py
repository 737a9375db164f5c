"""robot_description: print the URDF of a robot, for the parameter robot_description."""

from __future__ import annotations

from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import DescriptionOptions
from diff_encoder_sim.base.command_line import user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.robots'  # imported by the command on demand
EXAMPLES = ['burger', 'my_robot.urdf.xacro scale:=2 --frames']
parse = partial(read_options, DescriptionOptions, name='robot_description', description=__doc__, examples=EXAMPLES)


@user_errors('robot_description')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.robots import robot_urdf

    print(robot_urdf(parse(arguments)))
