"""robot_settings: find out about a robot and print the parameters of the nodes that follow, as YAML.

The launch files put them into the parameter /robot_settings, where the nodes read them.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, Dict, List, Optional, Sequence

import yaml

from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.nested_mappings import nested
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.cli.launched_robot import OWN_PPR, LaunchedRobot, add_launched_robot, launched_robot
from diff_encoder_sim.cli.robot_arguments import ROBOT_HELP
from diff_encoder_sim.lockstep.robot_params import check_key

LARGEST_INT = 2**31 - 1

# What campaigns set by themselves, and launch files by their arguments.
SET_BY_ARGUMENTS = (OWN_PPR, 'config.seed')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('robot_settings', lambda: _print_settings(_parse(arguments)))


def _print_settings(options: argparse.Namespace) -> None:
    robot = launched_robot(options, launch_arguments(options.values))
    for note in robot.notes:
        print(f'robot_settings: {note}', file=sys.stderr)
    settings = {key: _for_xml_rpc(value) for key, value in robot.settings.items()}
    print(yaml.safe_dump({**nested(settings), **_of_poses(robot)}, sort_keys=False))


def _for_xml_rpc(value: Any) -> Any:
    """Return a large whole number as text: the parameter server's have 32 bits. The nodes read it as a number."""
    is_large = isinstance(value, int) and abs(value) > LARGEST_INT
    return str(value) if is_large else value


def _of_poses(robot: LaunchedRobot) -> Dict[str, Any]:
    """Return the parameters of the nodes that have no file in config/."""
    model, base_frame = robot.setup.name, robot.params.odometry.base_frame
    return {
        'slam': {'base_frame': base_frame},
        'world_pose': {'model': model},
        'ideal_odom': {'model': model, 'base_frame': base_frame},
        'global_pose': {'base_frame': base_frame},
    }


def launch_arguments(words: List[str]) -> Dict[str, Any]:
    """Read FILE.KEY:=VALUE, the value as YAML; one without a value is not given.

    Raises:
        ConfigError: a word is none.
    """
    values = {}
    for word in words:
        key, separator, text = word.partition(':=')
        if not (key and separator):
            raise ConfigError(f'arguments: given {word!r}; allowed: FILE.KEY:=VALUE')
        if key not in SET_BY_ARGUMENTS:
            check_key(key)
        if text:
            values[key] = yaml_value(text, key)
    return values


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = tool_parser('robot_settings', __doc__, ['burger config.ppr:=90', 'my_robot.yaml'])
    parser.add_argument('robot', metavar='ROBOT', help=ROBOT_HELP)
    parser.add_argument('values', nargs='*', metavar='FILE.KEY:=VALUE', help="a parameter, before the robot's own")
    add_launched_robot(parser)
    return parser.parse_args(arguments)
