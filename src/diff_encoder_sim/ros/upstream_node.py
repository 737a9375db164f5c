"""upstream_node: starts upstream's map_server, amcl, move_base or slam_gmapping for a trial, as this process."""

from __future__ import annotations

import sys
from typing import List

import rosgraph.names
import rospy

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.ros.processes import become
from diff_encoder_sim.ros.trial_plan import required_trial_plan, trial_plan
from diff_encoder_sim.trials.required_packages import UPSTREAM_NAVIGATION, UPSTREAM_SLAM

# The package of each node, and how to install it.
NODES = {
    'map_server': ('map_server', UPSTREAM_NAVIGATION),
    'amcl': ('amcl', UPSTREAM_NAVIGATION),
    'move_base': ('move_base', UPSTREAM_NAVIGATION),
    'slam_gmapping': ('gmapping', UPSTREAM_SLAM),
}


def main() -> None:
    """Run the command line: `upstream_node map_server [MAP.yaml]`, or another node."""
    words = [argument for argument in sys.argv[1:] if ':=' not in argument]
    run_tool('upstream_node', lambda: _become_upstream(words))


def _become_upstream(words: List[str]) -> None:
    if not words or words[0] not in NODES or (words[1:] and words[0] != 'map_server'):
        raise ConfigError(
            f'arguments: given {" ".join(words)!r}; allowed: map_server [MAP.yaml], amcl, move_base, or slam_gmapping'
        )
    if words[0] == 'map_server':
        arguments = words[1:] or [required_trial_plan().map]
    else:
        arguments = _initial_pose() if words[0] == 'amcl' else []
    package, needed = NODES[words[0]]
    become(package, words[0], arguments, needed.install_hint)


def _initial_pose() -> List[str]:
    """Return the trial's start as private parameters, without those that the user has set."""
    plan = trial_plan()
    if plan is None:
        return []
    start = plan.trial.test.start
    name = rosgraph.names.load_mappings(sys.argv).get('__name', 'amcl')
    given = rospy.get_param(rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(), name), {})
    pose = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
    return [f'_{key}:={value!r}' for key, value in pose.items() if key not in given]
