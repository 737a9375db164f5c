"""robot_settings: inspect a robot and print the resulting parameters of the nodes, as YAML.

The launch files set the parameter /robot_settings with this output.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import SettingsOptions
from diff_encoder_sim.base.command_line import user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.robots'  # imported by the command on demand
EXAMPLES = ['burger config.ppr:=90', 'my_robot.yaml']
parse = partial(read_options, SettingsOptions, name='robot_settings', description=__doc__, examples=EXAMPLES)


@user_errors('robot_settings')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    import yaml

    from diff_encoder_sim.api.robots import node_settings

    settings, notes = node_settings(parse(arguments))
    for note in notes:
        print(f'robot_settings: {note}', file=sys.stderr)
    print(yaml.safe_dump(settings, sort_keys=False))
