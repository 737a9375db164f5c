"""A room, a scan with gaps and brute force, for the tests of the laser models."""

import math

import numpy as np

from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams

LASER_POSE = Pose2D(0.15, -0.05, 0.3)
RANGE_LIMIT_M = 3.5


def params(**changes):
    return AmclParams(**{**dict(laser_max_range=RANGE_LIMIT_M, laser_max_beams=10), **changes})


def turned_room():
    """The room on a grid whose own frame is turned in the map."""
    return pillar_room()._replace(origin=Pose2D(-3.0, -2.5, 0.4))


def particles_in_room(count, rng):
    """Spread so wide that some rays leave the map."""
    return np.column_stack([rng.normal(0, 1.5, (count, 2)), rng.uniform(-np.pi, np.pi, count)])


def scan_with_gaps(grid, pose):
    scan = simulated_scan(grid, pose, ray_count=37, laser_pose_in_base=LASER_POSE)
    ranges = scan.ranges_m.copy()
    ranges[[4, 12]], ranges[8], ranges[16] = np.nan, np.inf, 0.1
    return scan._replace(ranges_m=ranges)


def brute_force_distances(occupied, resolution_m, max_distance_m):
    rows, columns = np.nonzero(occupied)
    distances = np.full(occupied.shape, max_distance_m)
    for row in range(occupied.shape[0]):
        for column in range(occupied.shape[1]):
            if len(rows):
                nearest = np.hypot(rows - row, columns - column).min() * resolution_m
                distances[row, column] = min(nearest, max_distance_m)
    return distances


def reference_rays(grid, scan, particle, step):
    """(range, direction in the map, laser x, y) of each ray that counts, one by one."""
    cos_yaw, sin_yaw = math.cos(particle[2]), math.sin(particle[2])
    laser_x = particle[0] + cos_yaw * LASER_POSE.x_m - sin_yaw * LASER_POSE.y_m
    laser_y = particle[1] + sin_yaw * LASER_POSE.x_m + cos_yaw * LASER_POSE.y_m
    for index in range(0, len(scan.ranges_m), step):
        bearing = scan.angle_min_rad + index * scan.angle_increment_rad
        yield (scan.ranges_m[index], particle[2] + LASER_POSE.yaw_rad + bearing, laser_x, laser_y)
