"""Ahead-of-time compilation: the first control period must not take the seconds that numba needs."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.dwa_clouds import cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_params import NavigatorParams

CELLS, RESOLUTION_M = 60, 0.1
PERIOD_NS = 50_000_000  # of the two control periods below


def warm_up() -> None:
    """Run every kernel of the navigation once: a goal in a small room, with a turn in place.

    Takes milliseconds if numba's cache is filled, else some seconds.
    """
    navigator = Navigator(NavigatorParams(), _room())
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    # First the goal is ahead of the robot, then the robot is at the goal with another heading.
    for period, pose in enumerate((IDENTITY, Pose2D(1.0, 0.0, 1.0))):
        now_ns = period * PERIOD_NS
        navigator.take_odometry(now_ns, pose, 0.0, 0.0)
        navigator.take_localization(now_ns, IDENTITY)
        navigator.take_scan(Scan(now_ns, 0.0, 1.0, 0.1, 5.0, np.array([2.0, math.inf])))
        navigator.step(now_ns)
    task = navigator.scoring_task
    assert task is not None
    trajectory_cloud(task, IDENTITY), cost_cloud(task, IDENTITY)
    navigator.local_costmap.footprint_cost(IDENTITY)


def _room() -> OccupancyGrid:
    """Return the map of a square room around the origin."""
    cells = np.full((CELLS, CELLS), OCCUPIED, np.int8)
    cells[1:-1, 1:-1] = FREE
    corner_m = -0.5 * CELLS * RESOLUTION_M
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(corner_m, corner_m, 0.0))
