"""The laser as a reference: its poses in a room, by matching its scans with a map that they make.

Odometry is only the start of the search, so that its errors do not enter the poses. The map is made of all scans, so
that errors do not grow with the distance. Idea: Censi et al., "Simultaneous Calibration of Odometry and Sensor
Parameters for Mobile Robots", IEEE Transactions on Robotics 29 (2013), which matches one scan with the next.
"""

from __future__ import annotations

import logging
import math
from typing import Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.localization.grid_slam import OdometryTrack, search_of
from diff_encoder_sim.localization.patches import PatchMaps, Rays, usable_rays
from diff_encoder_sim.localization.slam_kernels import climb, refine
from diff_encoder_sim.localization.slam_params import GridSlamParams

log = logging.getLogger(__name__)

PERIOD_NS = NANOSECONDS_PER_SECOND // 2  # at least, between two scans that are used
NEW_PLACE_M, NEW_PLACE_RAD = 0.1, 0.1  # a scan enters the map after this motion: a robot at rest adds nothing
RANGE_STD_M = 0.03  # of a ray, in the covariances
SCALE_STD = 5e-4  # of walls that are seen on one side: 8 robots on the map ros_logo were up to 0.1 % off
GUESS_STD = np.array([0.05, 0.05, 0.05])  # of the start of a search [m, m, rad]

# Coarse cells find the match. A surface is a straight line through the hits near a point: in fine cells a pillar or a
# corner is hardly rounded, which moves the poses by 0.1 % of the room's size with the coarse ones.
_COARSE_M, _FINE_M, _FINE_PASSES = 0.05, 0.02, 2
_PARAMS = GridSlamParams(
    maxUrange=20.0, delta=_COARSE_M, sigma=0.002, lsigma=2.0 * RANGE_STD_M**2, ogain=1.0, iterations=2
)


class _Sight(NamedTuple):  # a scan that is used
    stamp_ns: int
    laser_pose_in_odom: Pose2D
    rays: Rays  # in the laser's frame


def scan_reference(scans: Iterable[Scan], odometry: PoseSeries, laser_pose_in_base: Pose2D = IDENTITY) -> Reference:
    """Return the poses of the laser in the frame of odometry at its first scan that is used.

    The covariances are those of the ranges' noise, RANGE_STD_M, without the map's errors. ConfigError if fewer than
    two scans can be used.

    Args:
        scans: in the order of their recording; one for each PERIOD_NS is used.
        odometry: poses of the base by wheels of about the right geometry; within 0.1 m and 0.1 rad for each PERIOD_NS.
        laser_pose_in_base: about where the laser is.
    """
    sights = list(_sights(scans, odometry, laser_pose_in_base))
    if len(sights) < 2:
        raise ConfigError(f'scans: given {len(sights)} usable scans at the times of odometry; allowed: at least 2')
    poses = _first_poses(sights)
    fine = _PARAMS.model_copy(update={'delta': _FINE_M})
    for _ in range(_FINE_PASSES):
        maps = _map_of(sights, poses, fine)
        matches = [_match(maps, sight.rays, pose, fine) for sight, pose in zip(sights, poses)]
        poses = [pose for pose, _ in matches]
    stamps_ns, covariances = [sight.stamp_ns for sight in sights], [covariance for _, covariance in matches]
    arrays = np.array(stamps_ns, np.int64), np.array(poses), np.array(covariances)
    return Reference('scan', *arrays, SCALE_STD)


def _sights(scans: Iterable[Scan], odometry: PoseSeries, laser_pose_in_base: Pose2D) -> Iterable[_Sight]:
    """Yield the scans to use; the log has the others with a fault."""
    ordered = odometry.by_time()
    track = OdometryTrack(ordered.stamps_ns.tolist(), [Pose2D(*row) for row in ordered.x_y_yaw.tolist()])
    due_ns: Optional[int] = None
    for scan in scans:
        if due_ns is not None and scan.stamp_ns < due_ns:
            continue
        try:
            base_pose, rays = track.at(scan.stamp_ns), usable_rays(scan, IDENTITY, _PARAMS)
        except InputFault as fault:
            log.info('scan at %.3f s not used: %s', scan.stamp_ns / NANOSECONDS_PER_SECOND, fault)
            continue
        due_ns = scan.stamp_ns + PERIOD_NS
        yield _Sight(scan.stamp_ns, base_pose.compose(laser_pose_in_base), rays)


def _first_poses(sights: Sequence[_Sight]) -> List[Pose2D]:
    """Match each scan with the map of those before it."""
    poses = [sights[0].laser_pose_in_odom]
    maps, entered = _map_of(sights[:1], poses, _PARAMS), poses[0]
    for before, sight in zip(sights, sights[1:]):
        guess = poses[-1].compose(sight.laser_pose_in_odom.relative_to(before.laser_pose_in_odom))
        poses.append(_match(maps, sight.rays, guess, _PARAMS)[0])
        entered = _enter(maps, sight.rays, poses[-1], entered)
    return poses


def _map_of(sights: Sequence[_Sight], poses: Sequence[Pose2D], params: GridSlamParams) -> PatchMaps:
    """Return the map of all scans at these poses."""
    maps, entered = PatchMaps(poses[0][:2], poses[0][:2], params.delta, 1), None
    for sight, pose in zip(sights, poses):
        entered = _enter(maps, sight.rays, pose, entered)
    return maps


def _enter(maps: PatchMaps, rays: Rays, pose: Pose2D, entered: Optional[Pose2D]) -> Pose2D:
    """Enter a scan into the map, unless it is near the pose of the last one; return the pose of the last one now."""
    if entered is not None:
        move = pose.relative_to(entered)
        if math.hypot(move.x_m, move.y_m) <= NEW_PLACE_M and abs(move.yaw_rad) <= NEW_PLACE_RAD:
            return entered
    reach_m = rays.reach_m()
    maps.cover(np.array(pose[:2]) - reach_m, np.array(pose[:2]) + reach_m)
    maps.update(np.array([pose]), rays)
    return pose


def _match(maps: PatchMaps, rays: Rays, guess: Pose2D, params: GridSlamParams) -> Tuple[Pose2D, np.ndarray]:
    """Return the pose near `guess` at which a scan fits the map best, and its covariance (3, 3)."""
    scale, corner = np.array([1.0 / maps.cell_m, 1.0 / maps.cell_m, 1.0]), np.append(maps.corner_m, 0.0)  # to cells
    start, ends = (np.array(guess) - corner) * scale, rays.matched_ends_m() / maps.cell_m
    of_map, search = (maps.table[0], maps.cells), search_of(params, maps.cell_m)
    found, _ = climb(*of_map, start, ends, search)
    found, root = refine(*of_map, found, start, ends, search, GUESS_STD * scale)
    deviations = np.linalg.inv(root) / scale  # their squares add up to the covariance
    return IDENTITY.compose(Pose2D(*(found / scale + corner).tolist())), deviations.T @ deviations
