"""Build maps by grid SLAM from a bag, or from a world file."""

from __future__ import annotations

import logging
import time
from pathlib import Path

from diff_encoder_sim.api.options import MapOptions, RasterOptions
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.scan_bag import read_scan_drive, read_scans
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.localization.grid_slam import GridSlam, OdometryTrack, map_recording, warm_up
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world

log = logging.getLogger(__name__)


def map_of_bag(options: MapOptions) -> str:
    """Build a map by grid SLAM from a bag's scans and odometry; return a summary line; ConfigError without data."""
    bag = options.bag
    params = load_params(GridSlamParams, options.config or package_folder() / 'config' / 'slam.yaml')
    source = open_source(bag)
    trial = trial_of_source(source)
    (stamps_ns, poses), laser_pose_in_base = read_scan_drive(source, options.scan, options.odom)
    track = OdometryTrack(stamps_ns.tolist(), [Pose2D(*row) for row in poses.tolist()])
    start = trial.test.start.pose() if trial else None
    slam = GridSlam(params, generator(trial.number if trial else options.seed, 'slam'), start)
    warm_up(params)
    begin_s = time.perf_counter()
    entered = map_recording(slam, track, read_scans(source, options.scan), laser_pose_in_base)
    took_s = time.perf_counter() - begin_s
    path = save_map(slam.map().cropped(SAVED_MARGIN_M), options.stem or bag.with_suffix(''))
    if source.fault:
        log.warning('%s: %s; using all readable messages', bag, source.fault)
    drive_s = (track.stamps_ns[-1] - track.stamps_ns[0]) / NANOSECONDS_PER_SECOND
    speed = f'{drive_s / took_s:.0f} times real time'
    return f'{path}: {entered} scans of a drive of {drive_s:.1f} s, in {took_s:.1f} s: {speed}'


def map_of_world(options: RasterOptions) -> Path:
    """Build a map from a .world file; return the path of its YAML file; ConfigError if the point is not free."""
    grid = rasterise(load_world(options.world), options.height, options.resolution, *options.free)
    return save_map(grid, options.out or options.world.with_suffix(''))
