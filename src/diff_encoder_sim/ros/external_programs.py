"""Tools that run external programs for a trial: upstream_node, gazebo_trial and place_robot."""

from __future__ import annotations

import argparse
import os
import sys
from typing import Sequence

import rosgraph.names
import roslib.packages
import rospkg
import rospy

from diff_encoder_sim.base.bounds import ANGLES, PLACES
from diff_encoder_sim.base.command_line import number_within, tool_parser, user_errors
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import merged
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.gazebo_states import SetModelState, launched_model
from diff_encoder_sim.ros.messages import pose_message
from diff_encoder_sim.ros.node import call_service, own_words, required_trial_plan, robot_settings, trial_plan
from diff_encoder_sim.trials.required_packages import GAZEBO, UPSTREAM_FUSION, UPSTREAM_NAVIGATION, UPSTREAM_SLAM

# Package of each node, its installation, and the part of /robot_settings with its parameters.
NODES = {
    'map_server': ('map_server', UPSTREAM_NAVIGATION, ''),
    'amcl': ('amcl', UPSTREAM_NAVIGATION, 'amcl'),
    'move_base': ('move_base', UPSTREAM_NAVIGATION, 'navigation'),
    'slam_gmapping': ('gmapping', UPSTREAM_SLAM, 'slam'),
    'ekf_localization_node': ('robot_localization', UPSTREAM_FUSION, 'fusion'),
}


def become(package: str, executable: str, arguments: Sequence[str], install_hint: str) -> None:
    """Replace this process by another package's executable, so that signals reach it; ConfigError if not installed."""
    try:
        found = roslib.packages.find_node(package, executable)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise ConfigError(f'{package} {executable} is not installed; {install_hint}')
    os.execv(found[0], [found[0], *arguments, *(argument for argument in sys.argv[1:] if ':=' in argument)])


@user_errors('upstream_node')
def upstream_node() -> None:
    """upstream_node: run one of upstream's NODES for a trial in this process."""
    words = own_words()
    if not words or words[0] not in NODES or (words[1:] and words[0] != 'map_server'):
        allowed = f'map_server [MAP.yaml], {", ".join(list(NODES)[1:])}'
        raise ConfigError(f'arguments: given {" ".join(words)!r}; allowed: {allowed}')
    node, arguments, plan = words[0], words[1:], trial_plan()
    package, needed, part = NODES[node]
    name = rosgraph.names.load_mappings(sys.argv).get('__name', node)  # that roslaunch gives the node
    full_name = str(rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), name))
    if node == 'map_server':
        arguments = arguments or [required_trial_plan().map]
    else:
        # The robot's settings among its private parameters, as the package's own nodes read them.
        for key, value in robot_settings(part).items():
            old = rospy.get_param(f'{full_name}/{key}', None)
            both_nested = isinstance(old, dict) and isinstance(value, dict)
            rospy.set_param(f'{full_name}/{key}', merged(old, value) if both_nested else value)
    if node == 'amcl' and plan is not None:
        start, given = plan.trial.test.start, rospy.get_param(full_name, {})
        pose = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
        arguments = [f'_{key}:={value!r}' for key, value in pose.items() if key not in given]
    become(package, node, arguments, needed.install_hint)


@user_errors('gazebo_trial')
def gazebo_trial() -> None:
    """gazebo_trial: run Gazebo's server with the trial's world, or spawn the robot, in this process."""
    words, plan = own_words(), required_trial_plan()
    if words == ['server']:
        become('gazebo_ros', 'gzserver', ['-u', '-e', 'ode', plan.world], GAZEBO.install_hint)  # -u: paused
    elif len(words) in (1, 2) and words[0] == 'spawn':
        model = words[1] if words[1:] else launched_model()
        start = plan.trial.test.start
        pose = ['-x', str(start.x), '-y', str(start.y), '-Y', str(start.yaw)]
        spawn = ['-urdf', '-param', 'gazebo_robot_description', '-model', model, *pose]
        become('gazebo_ros', 'spawn_model', spawn, GAZEBO.install_hint)
    else:
        raise ConfigError(f'arguments: given {" ".join(words)!r}; allowed: server, or spawn [MODEL]')


SET_MODEL_STATE = '/gazebo/set_model_state'


def parse_place_robot() -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('place_robot', str(place_robot.__doc__), ['-5.0 0.5 1.57'])
    for name in ('x', 'y'):
        parser.add_argument(name, type=number_within(PLACES), help='position of base_link in the world, in metres')
    heading = 'heading, counter-clockwise from the x axis, in radians'
    parser.add_argument('yaw', type=number_within(ANGLES), help=heading)
    parser.add_argument('--model', metavar='NAME', help="the robot's model (default: the launched robot's)")
    return parser.parse_args(own_words())


@user_errors('place_robot')
def place_robot() -> None:
    """place_robot: move the robot to another pose in the running simulation, at rest, by /gazebo/set_model_state.

    Odometry does not change: this is the kidnapped-robot problem for localization.
    """
    options, request = parse_place_robot(), SetModelState._request_class()
    request.model_state.pose = pose_message(Pose2D(options.x, options.y, options.yaw))
    try:
        request.model_state.model_name = options.model or launched_model()
        response = call_service(SET_MODEL_STATE, SetModelState, request)
    except (OSError, rospy.ROSException, rospy.ServiceException) as error:
        raise ConfigError(f'{SET_MODEL_STATE}: {error}; expected a running simulation') from None
    if not response.success:
        raise ConfigError(f'{SET_MODEL_STATE}: {response.status_message}')
    print(response.status_message)
