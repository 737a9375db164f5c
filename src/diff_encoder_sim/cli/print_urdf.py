"""robot_description: the URDF of a robot. Its help is in print_urdf_arguments."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.cli.print_urdf_arguments import parse
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from diff_encoder_sim.robots.xacro_expansion import (
    display_urdf,
    expand,
    without_root_inertia,
    xacro_arguments,
    xacro_arguments_of_text,
)


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('robot_description', lambda: print(_urdf(parse(arguments))))


def _urdf(options: argparse.Namespace) -> str:
    arguments = {**xacro_arguments_of_text(options.robot_args), **xacro_arguments(options.arguments, 'argument')}
    # roslaunch starts its commands in a folder of its own.
    users_folder = Path(os.environ.get('PWD', '.'))
    file = load_robot_file(options.robot, users_folder, package_folder(), arguments)
    if options.frames:
        setup = set_up_robot(file)
        return display_urdf(file.source, (setup.description.left.joint, setup.description.right.joint))
    return expand(without_root_inertia(file.source) if options.no_root_inertia else file.source)
