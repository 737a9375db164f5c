"""The command line of place_robot."""

from __future__ import annotations

import argparse

from diff_encoder_sim.base.bounds import ANGLES, PLACES
from diff_encoder_sim.base.command_line import number_within, tool_parser
from diff_encoder_sim.ros.own_words import own_words

DESCRIPTION = """\
place_robot: move the robot to another pose in the running simulation, at rest, by /gazebo/set_model_state.

Odometry does not notice it: this is the kidnapped-robot problem for localization."""


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('place_robot', DESCRIPTION, ['-5.0 0.5 1.57'])
    parser.add_argument('x', type=number_within(PLACES), help='position of base_link in the world, in metres')
    parser.add_argument('y', type=number_within(PLACES), help='position of base_link in the world, in metres')
    parser.add_argument(
        'yaw', type=number_within(ANGLES), help='heading, counter-clockwise from the x axis, in radians'
    )
    parser.add_argument('--model', metavar='NAME', help="the robot's model (default: the launched robot's)")
    return parser.parse_args(own_words())
