"""A small room of walls and a pillar, scanned exactly, for the tests of SLAM."""

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.simulation.lidar import cast_rays

# 5 x 4 m with an alcove, about the origin; x0, y0, x1, y1 of each wall.
CORNERS = np.array([(-2.52, -2.03), (2.48, -2.03), (2.48, 1.97), (1.1, 1.97), (1.1, 1.48), (-2.52, 1.48)])
SEGMENTS = np.hstack([CORNERS, np.roll(CORNERS, -1, axis=0)])
CIRCLES = np.array([(1.3, -1.1, 0.2)])
RANGE_MAX_M = 6.0

SMALL = dict(
    xmin=-4.0,
    ymin=-4.0,
    xmax=4.0,
    ymax=4.0,
    particles=8,
    lskip=1,
    sigma=0.002,
    lsigma=0.001,
    ogain=1.0,
    linearUpdate=0.2,
    angularUpdate=0.2,
)


def params(**changes):
    return GridSlamParams(**{**SMALL, **changes})


def room_scan(base_pose, rng=None, sigma_m=0.01, ray_count=360, laser_pose_in_base=IDENTITY, stamp_ns=0):
    laser = base_pose.compose(laser_pose_in_base)
    increment = 2.0 * math.pi / ray_count
    bearings = -math.pi + increment * np.arange(ray_count)
    ranges = cast_rays(laser.x_m, laser.y_m, laser.yaw_rad + bearings, SEGMENTS, CIRCLES)
    if rng is not None:
        ranges = ranges + sigma_m * rng.standard_normal(ray_count)
    return Scan(stamp_ns, -math.pi, increment, 0.15, RANGE_MAX_M, ranges)


def around_the_room(count=40):
    """Poses on a circle, one and a half times around."""
    return [
        Pose2D(0.0, -0.8, 0.0).compose(Pose2D(0.8 * math.sin(angle), 0.8 * (1.0 - math.cos(angle)), angle))
        for angle in np.linspace(0.0, 3.0 * math.pi, count)
    ]
