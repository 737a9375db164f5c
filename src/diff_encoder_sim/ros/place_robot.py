"""place_robot: move the robot to another pose in the running simulation, at rest, by /gazebo/set_model_state.

Odometry does not notice it: this is the kidnapped-robot problem for localization.
"""

from __future__ import annotations

import argparse

import rospy

from diff_encoder_sim.base.bounded_numbers import ANGLES, PLACES
from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.number_arguments import number_within
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_message
from diff_encoder_sim.ros.gazebo_messages import SetModelState
from diff_encoder_sim.ros.model_states import launched_model
from diff_encoder_sim.ros.service_call import call_service

SERVICE = '/gazebo/set_model_state'


def main() -> None:
    """Run the command line."""
    run_tool('place_robot', lambda: _place(_parse()))


def _place(options: argparse.Namespace) -> None:
    request = SetModelState._request_class()
    request.model_state.pose = pose_message(Pose2D(options.x, options.y, options.yaw))
    try:
        request.model_state.model_name = options.model or launched_model()
        response = call_service(SERVICE, SetModelState, request)
    except (OSError, rospy.ROSException, rospy.ServiceException) as error:
        raise ConfigError(f'{SERVICE}: {error}; expected a running simulation') from None
    if not response.success:
        raise ConfigError(f'{SERVICE}: {response.status_message}')
    print(response.status_message)


def _parse() -> argparse.Namespace:
    parser = tool_parser('place_robot', __doc__, ['-5.0 0.5 1.57'])
    parser.add_argument('x', type=number_within(PLACES), help='position of base_link in the world, in metres')
    parser.add_argument('y', type=number_within(PLACES), help='position of base_link in the world, in metres')
    parser.add_argument(
        'yaw', type=number_within(ANGLES), help='heading, counter-clockwise from the x axis, in radians'
    )
    parser.add_argument('--model', metavar='NAME', help="the robot's model (default: the launched robot's)")
    return parser.parse_args(rospy.myargv()[1:])
