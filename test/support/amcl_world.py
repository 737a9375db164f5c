"""A small map and simulated scans for the tests of AMCL."""

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid

RESOLUTION_M = 0.05
RANGE_MAX_M = 6.0
START = Pose2D(0.9, -0.6, 1.8)
ELSEWHERE = Pose2D(-2.0, -0.2, -0.9)


def pillar_room():
    """A room of 6 x 5 m about the map's origin with walls, an alcove and four uneven pillars."""
    height, width = 100, 120
    cells = np.full((height, width), FREE, dtype=np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    cells[70:100, 95:120] = OCCUPIED
    y, x = np.mgrid[:height, :width] + 0.5
    for pillar_x, pillar_y, radius in ((30, 25, 4), (85, 30, 3), (38, 72, 5), (70, 60, 2.5)):
        cells[(x - pillar_x) ** 2 + (y - pillar_y) ** 2 <= radius**2] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(-3.0, -2.5, 0.0))


def simulated_scan(grid, base_pose, rng=None, ray_count=180, sigma_m=0.0, laser_pose_in_base=IDENTITY, stamp_ns=0):
    """What a laser sees at a base pose in the map: marched through the cells in steps of 2 mm."""
    increment = 2.0 * math.pi / ray_count
    laser = base_pose.compose(laser_pose_in_base)
    bearings = -math.pi + increment * np.arange(ray_count)
    distances = np.arange(0.0, RANGE_MAX_M + 1.0, 0.002)
    local = laser.relative_to(grid.origin)
    directions = local.yaw_rad + bearings[:, np.newaxis]
    columns = np.floor((local.x_m + distances * np.cos(directions)) / grid.resolution_m)
    rows = np.floor((local.y_m + distances * np.sin(directions)) / grid.resolution_m)
    inside = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
    occupied = np.zeros(columns.shape, dtype=bool)
    occupied[inside] = grid.cells[rows[inside].astype(int), columns[inside].astype(int)] == OCCUPIED
    ranges = np.where(occupied.any(axis=1), distances[occupied.argmax(axis=1)], np.inf)
    if rng is not None:
        ranges = ranges + sigma_m * rng.standard_normal(ray_count)
    ranges[ranges >= RANGE_MAX_M] = np.inf
    return Scan(stamp_ns, -math.pi, increment, 0.15, RANGE_MAX_M, ranges)


def moved(pose, forward_m, turn_rad):
    return pose.compose(Pose2D(forward_m, 0.0, turn_rad))
