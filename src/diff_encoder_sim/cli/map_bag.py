"""map_bag: build a map by grid SLAM from the scans and the odometry in a bag, faster than real time.

The bag also needs /tf_static for the pose of the laser. The map of a bag from trial.launch is in the world frame,
because the start pose of the test is known; the origin of other maps is that of odometry.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.bounds import SEEDS
from diff_encoder_sim.base.command_line import as_called, tool_parser, user_errors, whole_number_within
from diff_encoder_sim.drives import topics

API = 'api.maps'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    parser = tool_parser('map_bag', __doc__, ['bags/drive.bag -f maps/office'])
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag (ROS 1 or 2) with scans, odometry and /tf_static')
    parser.add_argument(
        '-f', dest='stem', type=Path, metavar='STEM', help='write STEM.pgm and STEM.yaml (default: next to the bag)'
    )
    parser.add_argument(
        '--config', type=Path, metavar='FILE', help="parameters, by slam_gmapping's names (default: config/slam.yaml)"
    )
    parser.add_argument('--scan', default=topics.SCAN, metavar='TOPIC', help='topic of scans (default: %(default)s)')
    parser.add_argument('--odom', default=topics.ODOM, metavar='TOPIC', help='topic of odometry (default: %(default)s)')
    parser.add_argument(
        '--seed',
        type=whole_number_within(SEEDS),
        default=0,
        metavar='N',
        help="seed of the particles; a trial's bag uses the trial's number (default: %(default)s)",
    )
    return parser.parse_args(arguments)


@user_errors('map_bag')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.maps import map_of_bag

    logging.basicConfig(format=f'{as_called("map_bag")}: %(message)s')
    print(map_of_bag(**vars(parse(arguments))))
