"""map_bag: build a map by grid SLAM from the scans and the odometry in a bag, faster than real time.

The bag also needs /tf_static for the pose of the laser. The map of a bag from trial.launch is in the world frame,
because the start pose of the test is known; the origin of other maps is that of odometry.
"""

from __future__ import annotations

import logging
from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import MapOptions
from diff_encoder_sim.base.command_line import as_called, user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.maps'  # imported by the command on demand
EXAMPLES = ['bags/drive.bag -f maps/office']
parse = partial(read_options, MapOptions, name='map_bag', description=__doc__, examples=EXAMPLES)


@user_errors('map_bag')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.maps import map_of_bag

    logging.basicConfig(format=f'{as_called("map_bag")}: %(message)s')
    print(map_of_bag(parse(arguments)))
