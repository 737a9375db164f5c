"""check_robot: inspect a robot from its URDF or xacro, and check its simulated motion.

Prints the detected values with their sources, and the results of a drive on a flat floor: whether the motion agrees
with the wheels, whether the robot stands on them and has enough torque, and the position of its laser.
"""

from __future__ import annotations

from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import InspectOptions
from diff_encoder_sim.base.command_line import user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.robots'  # imported by the command on demand
EXAMPLES = ['my_robot.urdf.xacro --write my_robot.yaml', 'burger']
parse = partial(read_options, InspectOptions, name='check_robot', description=__doc__, examples=EXAMPLES)


@user_errors('check_robot')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.robots import inspect_robot

    inspect_robot(parse(arguments), show=lambda text: print(text, flush=True))
