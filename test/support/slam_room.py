"""A small room of walls and a pillar, scanned exactly, and particles' maps of it, for the tests of SLAM."""

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.patches import PatchMaps, usable_rays
from diff_encoder_sim.localization.slam_params import SIDE, GridSlamParams
from diff_encoder_sim.simulation.lidar import cast_rays

# 5 x 4 m with an alcove, about the origin; x0, y0, x1, y1 of each wall.
CORNERS = np.array([(-2.52, -2.03), (2.48, -2.03), (2.48, 1.97), (1.1, 1.97), (1.1, 1.48), (-2.52, 1.48)])
SEGMENTS = np.hstack([CORNERS, np.roll(CORNERS, -1, axis=0)])
CIRCLES = np.array([(1.3, -1.1, 0.2)])
RANGE_MAX_M = 6.0

BOUNDS = dict(xmin=-4.0, ymin=-4.0, xmax=4.0, ymax=4.0)
SMALL = dict(particles=8, lskip=1, sigma=0.002, lsigma=0.001, ogain=1.0, linearUpdate=0.2, angularUpdate=0.2)
CELL_M = 0.05


def params(**changes):
    return GridSlamParams(**{**BOUNDS, **SMALL, **changes})


def room_scan(base_pose, rng=None, sigma_m=0.01, ray_count=360, laser_pose_in_base=IDENTITY, stamp_ns=0):
    laser = base_pose.compose(laser_pose_in_base)
    increment = 2.0 * math.pi / ray_count
    bearings = -math.pi + increment * np.arange(ray_count)
    ranges = cast_rays(laser.x_m, laser.y_m, laser.yaw_rad + bearings, SEGMENTS, CIRCLES)
    if rng is not None:
        ranges = ranges + sigma_m * rng.standard_normal(ray_count)
    return Scan(stamp_ns, -math.pi, increment, 0.15, RANGE_MAX_M, ranges)


def around_the_room(count=40):
    return [
        Pose2D(0.0, -0.8, 0.0).compose(Pose2D(0.8 * math.sin(angle), 0.8 * (1.0 - math.cos(angle)), angle))
        for angle in np.linspace(0.0, 3.0 * math.pi, count)
    ]


def maps_of(count):
    return PatchMaps((-4.0, -4.0), (4.0, 4.0), CELL_M, count)


def rays_of(ranges, **changes):
    scan = Scan(0, 0.0, 0.5 * np.pi, 0.1, 6.0, np.array(ranges, dtype=float))
    return usable_rays(scan, changes.pop('laser', IDENTITY), params(**changes))


def cells_of(maps, particle):
    """(height, width, 4) of one particle's grid."""
    rows, columns = maps.table.shape[1:]
    return maps.cells[maps.table[particle]].transpose(0, 2, 1, 3, 4).reshape(rows * SIDE, columns * SIDE, 4)


def room_map(particles=1, scans=6, sigma_m=0.01, seed=1):
    rng, maps = np.random.default_rng(seed), maps_of(particles)
    for _ in range(scans):
        pose = Pose2D(*rng.uniform(-0.3, 0.3, 3).tolist())
        rays = usable_rays(room_scan(pose, rng, sigma_m), IDENTITY, params())
        maps.update(np.tile(np.array(pose), (particles, 1)), rays)
    return maps


def patch_counts(maps):
    """Patches in use, each counted once, and those if every particle had its own grid of what it has seen."""
    return len(maps.references) - 1 - int(maps.free_count[0]), int(np.count_nonzero(maps.table))
