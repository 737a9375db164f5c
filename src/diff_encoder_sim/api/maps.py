"""Build maps by grid SLAM from a bag, or from a world file."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.scan_bag import read_scan_drive, read_scans
from diff_encoder_sim.drives.topics import ODOM, SCAN
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.localization.grid_slam import GridSlam, OdometryTrack, map_recording, warm_up
from diff_encoder_sim.localization.map_files import save_map
from diff_encoder_sim.localization.occupancy_grid import SAVED_MARGIN_M
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world

log = logging.getLogger(__name__)


def map_of_bag(
    bag: Path,
    stem: Optional[Path] = None,
    config: Optional[Path] = None,
    scan: str = SCAN,
    odom: str = ODOM,
    seed: int = 0,
) -> str:
    """Build a map by grid SLAM from the scans and the odometry of a bag; return a summary line.

    Args:
        bag: ROS 1 or ROS 2 bag.
        stem: path of STEM.pgm and STEM.yaml; next to the bag by default.
        config: file with parameters of slam_gmapping.
        scan: topic of the scans.
        odom: topic of the odometry.
        seed: seed of the particles; ignored for the bag of a trial, which uses the trial's number.

    Raises:
        ConfigError: a file cannot be read or written, or contains no data for a map.
    """
    params = load_params(GridSlamParams, config or package_folder() / 'config' / 'slam.yaml')
    with open_source(bag) as source:
        trial = trial_of_source(bag, source)
        drive = read_scan_drive(bag, source, scan, odom)
        track = OdometryTrack(drive.odometry_ns, drive.base_poses_in_odom)
        start = trial.test.start.pose() if trial else None
        slam = GridSlam(params, generator(trial.number if trial else seed, 'slam'), start)
        warm_up(params)
        begin_s = time.perf_counter()
        entered = map_recording(slam, track, read_scans(bag, source, scan), drive.laser_pose_in_base)
        fault = source.fault
    took_s = time.perf_counter() - begin_s
    path = save_map(slam.map().cropped(SAVED_MARGIN_M), stem or bag.with_suffix(''))
    if fault:
        log.warning('%s: %s; using all readable messages', bag, fault)
    drive_s = (track.stamps_ns[-1] - track.stamps_ns[0]) / NANOSECONDS_PER_SECOND
    return (
        f'{path}: {entered} scans of a drive of {drive_s:.1f} s, in {took_s:.1f} s: '
        f'{drive_s / took_s:.0f} times real time'
    )


def map_of_world(
    world: Path, free: Sequence[float], height: float, resolution: float, out: Optional[Path] = None
) -> Path:
    """Build a map from a .world file; return the path of its YAML file.

    Args:
        world: SDF file of primitives.
        free: x, y [m] of a point in free space; all space reachable from it is free in the map.
        height: height of the scan plane above the floor [m].
        resolution: side of a cell [m].
        out: stem of the output files; next to the world by default.

    Raises:
        ConfigError: the world cannot be read, or the point is not free.
    """
    return save_map(rasterise(load_world(world), height, resolution, *free), out or world.with_suffix(''))
