"""map_bag: build a map by grid SLAM from the scans and the odometry in a bag, faster than real time.

The bag also needs /tf_static, for the laser's mounting. The map of a bag that trial.launch recorded is in the world's
frame, because the test's start pose is surveyed; any other map has its origin where odometry is zero.
"""

from __future__ import annotations

import argparse
import logging
import time
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.bounded_numbers import SEEDS
from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.command_name import as_called
from diff_encoder_sim.base.number_arguments import whole_number_within
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.base.typed_params import load_params
from diff_encoder_sim.mapping.map_files import save_map
from diff_encoder_sim.mapping.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.bag_source import open_source
from diff_encoder_sim.recording.scan_bag import ScanBag
from diff_encoder_sim.recording.trial_metadata import trial_of_source
from diff_encoder_sim.slam.grid_slam import GridSlam
from diff_encoder_sim.slam.offline import OdometryTrack, map_recording
from diff_encoder_sim.slam.slam_params import GridSlamParams
from diff_encoder_sim.slam.slam_warm_up import warm_up

log = logging.getLogger(__name__)


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    logging.basicConfig(format=f'{as_called("map_bag")}: %(message)s')
    run_tool('map_bag', lambda: _map_bag(_parse(arguments)))


def _map_bag(options: argparse.Namespace) -> None:
    params = load_params(GridSlamParams, options.config)
    with open_source(options.bag) as source:
        trial = trial_of_source(options.bag, source)
        drive = ScanBag(options.bag, source, options.scan, options.odom)
        track = OdometryTrack(drive.odometry_ns, drive.base_poses_in_odom)
        start = trial.test.start.pose() if trial else None
        slam = GridSlam(params, generator(trial.number if trial else options.seed, 'slam'), start)
        warm_up(params)
        begin_s = time.perf_counter()
        entered = map_recording(slam, track, drive.scans(), drive.laser_pose_in_base)
        fault = source.fault
    took_s = time.perf_counter() - begin_s
    path = save_map(slam.map().cropped(SAVED_MARGIN_M), options.stem or options.bag.with_suffix(''))
    if fault:
        log.warning('%s: %s; all messages that can be read are used', options.bag, fault)
    drive_s = (track.stamps_ns[-1] - track.stamps_ns[0]) / NANOSECONDS_PER_SECOND
    print(
        f'{path}: {entered} scans of a drive of {drive_s:.1f} s, in {took_s:.1f} s: '
        f'{drive_s / took_s:.0f} times real time'
    )


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = tool_parser('map_bag', __doc__, ['bags/drive.bag -f maps/office'])
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag (ROS 1 or 2) with scans, odometry and /tf_static')
    parser.add_argument(
        '-f', dest='stem', type=Path, metavar='STEM', help='write STEM.pgm and STEM.yaml (default: beside the bag)'
    )
    parser.add_argument(
        '--config',
        type=Path,
        metavar='FILE',
        default=package_folder() / 'config' / 'slam.yaml',
        help="parameters, by slam_gmapping's names (default: config/slam.yaml)",
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
