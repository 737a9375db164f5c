"""map_bag: grid SLAM from a bag. Its help is in map_bag_arguments."""

from __future__ import annotations

import argparse
import logging
import time
from typing import Optional, Sequence

from diff_encoder_sim.base.command_line import as_called, run_tool
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.cli.map_bag_arguments import parse
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.scan_bag import ScanBag
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.localization.grid_slam import GridSlam, OdometryTrack, map_recording, warm_up
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.localization.slam_params import GridSlamParams

log = logging.getLogger(__name__)


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    logging.basicConfig(format=f'{as_called("map_bag")}: %(message)s')
    run_tool('map_bag', lambda: _map_bag(parse(arguments)))


def _map_bag(options: argparse.Namespace) -> None:
    params = load_params(GridSlamParams, options.config or package_folder() / 'config' / 'slam.yaml')
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
