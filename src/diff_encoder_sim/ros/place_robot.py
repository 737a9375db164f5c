"""place_robot: puts the robot elsewhere in the running simulation, as a kidnapper would."""

from __future__ import annotations

import argparse

import rospy

from diff_encoder_sim.base.console import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_message
from diff_encoder_sim.ros.gazebo_messages import SetModelState

SERVICE = '/gazebo/set_model_state'


def main() -> None:
    """Entry point of the executable."""
    run_tool('place_robot', lambda: _place(_parse()))


def _place(options: argparse.Namespace) -> None:
    request = SetModelState._request_class()
    request.model_state.model_name = options.model
    request.model_state.pose = pose_message(Pose2D(options.x, options.y, options.yaw))
    try:
        answer = rospy.ServiceProxy(SERVICE, SetModelState)(request)
    except (rospy.ROSException, rospy.ServiceException) as error:
        raise ConfigError(f'{SERVICE}: no answer: {error}; allowed: a running simulation') from None
    if not answer.success:
        raise ConfigError(f'{SERVICE}: {answer.status_message}')
    print(answer.status_message)


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='place_robot', description=__doc__, epilog='example: place_robot -5.0 0.5 1.57'
    )
    parser.add_argument('x', type=float, help='of base_link in the world [m]')
    parser.add_argument('y', type=float, help='[m]')
    parser.add_argument('yaw', type=float, help='counter-clockwise [rad]')
    parser.add_argument('--model', default='alto', help='name of the robot (default: %(default)s)')
    return parser.parse_args(rospy.myargv()[1:])
