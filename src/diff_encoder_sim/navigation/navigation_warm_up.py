"""Compiling ahead: the first control period must not take the seconds that numba needs."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_params import NavigatorParams

CELLS, RESOLUTION_M = 60, 0.1
PERIOD_NS = 50_000_000


def warm_up() -> None:
    """Run every kernel of the navigation once: a goal in a small room, with a turn on the spot.

    Takes milliseconds where numba's cache is filled, some seconds where it is not.
    """
    cells = np.full((CELLS, CELLS), OCCUPIED, np.int8)
    cells[1:-1, 1:-1] = FREE
    corner_m = -0.5 * CELLS * RESOLUTION_M
    navigator = Navigator(NavigatorParams(), OccupancyGrid(cells, RESOLUTION_M, Pose2D(corner_m, corner_m, 0.0)))
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    # Ahead of the robot, then at the goal but turned away from its heading.
    for period, pose in enumerate((IDENTITY, Pose2D(1.0, 0.0, 1.0))):
        now_ns = period * PERIOD_NS
        navigator.take_odometry(now_ns, pose, 0.0, 0.0)
        navigator.take_localization(now_ns, IDENTITY)
        navigator.take_scan(Scan(now_ns, 0.0, 1.0, 0.1, 5.0, np.array([2.0, math.inf])))
        navigator.step(now_ns)
    navigator.local_costmap.footprint_cost(IDENTITY)
