"""upstream_node: starts upstream's map_server, amcl, move_base or slam_gmapping for a trial, as this process."""

from __future__ import annotations

import sys
from typing import List

import rosgraph.names
import rospy

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import merged
from diff_encoder_sim.ros.graph import become
from diff_encoder_sim.ros.node import required_trial_plan, robot_settings, trial_plan
from diff_encoder_sim.ros.own_words import own_words
from diff_encoder_sim.trials.required_packages import UPSTREAM_NAVIGATION, UPSTREAM_SLAM

# The package of each node, and how to install it.
NODES = {
    'map_server': ('map_server', UPSTREAM_NAVIGATION),
    'amcl': ('amcl', UPSTREAM_NAVIGATION),
    'move_base': ('move_base', UPSTREAM_NAVIGATION),
    'slam_gmapping': ('gmapping', UPSTREAM_SLAM),
}

# The parts of /robot_settings with their parameters.
PARTS = {'amcl': 'amcl', 'move_base': 'navigation', 'slam_gmapping': 'slam'}


def main() -> None:
    """Run the command line: `upstream_node map_server [MAP.yaml]`, or another node."""
    run_tool('upstream_node', lambda: _become_upstream(own_words()))


def _become_upstream(words: List[str]) -> None:
    if not words or words[0] not in NODES or (words[1:] and words[0] != 'map_server'):
        raise ConfigError(
            f'arguments: given {" ".join(words)!r}; allowed: map_server [MAP.yaml], amcl, move_base, or slam_gmapping'
        )
    if words[0] == 'map_server':
        arguments = words[1:] or [required_trial_plan().map]
    else:
        _set_private_parameters(words[0])
        arguments = _initial_pose() if words[0] == 'amcl' else []
    package, needed = NODES[words[0]]
    become(package, words[0], arguments, needed.install_hint)


def _set_private_parameters(node: str) -> None:
    """Give upstream's node the robot's settings where it reads them, as the package's own nodes read them."""
    for key, value in robot_settings(PARTS[node]).items():
        old = rospy.get_param(f'{_name(node)}/{key}', None)
        both_nested = isinstance(old, dict) and isinstance(value, dict)
        rospy.set_param(f'{_name(node)}/{key}', merged(old, value) if both_nested else value)


def _initial_pose() -> List[str]:
    """Return the trial's start as private parameters, without those that the user has set."""
    plan = trial_plan()
    if plan is None:
        return []
    start, given = plan.trial.test.start, rospy.get_param(_name('amcl'), {})
    pose = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
    return [f'_{key}:={value!r}' for key, value in pose.items() if key not in given]


def _name(node: str) -> str:
    """Return the full name that roslaunch gives the node."""
    name = rosgraph.names.load_mappings(sys.argv).get('__name', node)
    return str(rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), name))
