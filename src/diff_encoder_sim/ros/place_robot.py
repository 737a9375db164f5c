"""place_robot: moves the robot to another pose in the running simulation."""

from __future__ import annotations

import argparse

import rospy

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_message
from diff_encoder_sim.ros.gazebo_messages import SetModelState
from diff_encoder_sim.ros.model_states import launched_model
from diff_encoder_sim.ros.node import call_service
from diff_encoder_sim.ros.place_robot_arguments import parse

SERVICE = '/gazebo/set_model_state'


def main() -> None:
    """Run the command line."""
    run_tool('place_robot', lambda: _place(parse()))


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
