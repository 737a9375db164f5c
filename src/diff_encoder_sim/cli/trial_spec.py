"""trial_spec: check the arguments of trial.launch and print the plan of the trial, which becomes the parameter /trial.

trial.launch calls it before any node starts, so that a wrong argument ends the launch with one line.
"""

from __future__ import annotations

import argparse
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import tool_parser, user_errors
from diff_encoder_sim.cli.arguments import ROBOT_HELP, add_launched_robot

API = 'api.live_trials'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line; values are checked by `plan`."""
    parser = tool_parser('trial_spec', __doc__, ['--test SL --ppr 90 --trial 3 --bag sl.bag'])
    for option, default, text in (
        ('--ppr', '', "pulses per wheel revolution: 90, or '{left: 90, right: 1024}' (default: the robot's own)"),
        ('--trial', '0', 'number of the trial, which is its seed'),
        ('--odom', 'encoder', 'encoder or ideal'),
        ('--nav', 'embedded', 'embedded, upstream or scripted'),
        ('--slam', 'none', 'none, embedded or upstream'),
        ('--save-map', '', 'path without suffix for the map from SLAM (default: not saved)'),
        ('--sim', 'pybullet', 'pybullet or gazebo'),
        ('--map', '', 'map .yaml file (default: the one next to the world)'),
        ('--bag', '', 'path of the bag to record, or none (default: a new name in bags/)'),
        ('--robot', 'alto', ROBOT_HELP),
        ('--unchecked', 'false', 'true: skip the robot self-check and the fit to the test'),
    ):
        shown = f' (default: {default})' if default else ''
        parser.add_argument(option, default=default, metavar='VALUE', help=text + shown)
    add_launched_robot(parser)
    parser.add_argument('--test', required=True, metavar='TEST', help='SL, SMT, DLD, or a .yaml file')
    return parser.parse_args(arguments)


@user_errors('trial.launch')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line; errors start with trial.launch, which the user called."""
    from diff_encoder_sim.api.live_trials import TrialOptions, plan_as_yaml

    print(plan_as_yaml(TrialOptions(**vars(parse(arguments)))), end='')
