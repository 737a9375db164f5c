"""Costmaps and plans in which navigation is tested."""

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.navigator_params import DwaParams
from navigation_simulation import TABLE_2

PERIOD_S = 0.05
RAYS, RAY_STEP_RAD = 200, 2.0 * math.pi / 200


def dwa_params(**changes):
    return DwaParams.from_mapping({**TABLE_2, **changes}, '')


def static_costmap(cells, origin=IDENTITY, **params):
    return Costmap(CostmapParams.from_mapping(params, ''), OccupancyGrid(np.asarray(cells, np.int8), 0.05, origin))


def scan_of(ranges_by_degree, rays=360):
    ranges = np.full(rays, np.nan)
    for degree, range_m in ranges_by_degree.items():
        ranges[degree] = range_m
    return Scan(0, 0.0, math.radians(1.0), 0.15, 6.0, ranges)


def local_costmap(marked=(), **params):
    """A window around (0, 0), with lethal cells at points (x, y) [m]."""
    costmap = Costmap(local_defaults(**params))
    for x, y in marked:
        costmap._obstacles[costmap.cell_at(x, y)] = 254
    return costmap


def seen_costmap(random, **params):
    """A window around (0, 0) that has seen a scan of obstacles at random distances."""
    costmap = Costmap(local_defaults(inflation_radius=0.8, cost_scaling_factor=3.0, **params))
    ranges_m = np.where(random.random(RAYS) < 0.03, random.uniform(0.45, 1.5, RAYS), math.inf)
    costmap.update(IDENTITY, Scan(0, 0.0, RAY_STEP_RAD, 0.15, 6.0, ranges_m), IDENTITY)
    return costmap


def straight_plan(length_m=1.4, bearing_rad=0.0):
    distance = np.arange(0.0, length_m + 1e-9, 0.025)
    return np.column_stack(
        [distance * math.cos(bearing_rad), distance * math.sin(bearing_rad), np.full_like(distance, bearing_rad)]
    )


def winding_plan(random, points=60):
    """(n, 3) from near (0, 0) on, with turns."""
    yaws_rad = random.uniform(-3.0, 3.0) + np.cumsum(random.normal(0.0, 0.15, points))
    steps_m = 0.025 * np.column_stack([np.cos(yaws_rad), np.sin(yaws_rad)])
    return np.column_stack([random.uniform(-0.05, 0.05, 2) + np.cumsum(steps_m, axis=0), yaws_rad])
