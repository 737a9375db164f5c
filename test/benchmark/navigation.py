#!/usr/bin/env python3
"""Time that navigation takes: one DWA cycle, costmap updates, distance transforms, global plans.

The DWA aims below 1.5 ms a cycle with upstream's default samples. Compile times are apart: they are spent once, then
numba's cache on disk serves every process.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import numpy as np
from checkout import ROOT, print_header
from tabulate import tabulate

sys.path.insert(0, str(ROOT / 'test' / 'support'))

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.distances import squared_distances
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_kernels import score_all
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, NavfnParams
from navigation_simulation import LASER_IN_BASE, TABLE_2, ClosedLoop, Robot, navigator_params, rasterise, read_shapes

PERIOD_S = 0.05

# Beside a pillar of the ROS-logo world, between two of them: obstacles in half of the window.
POSE = Pose2D(-1.9, -0.935, 0.0)
WIDE = {'inflation_radius': 1.0, 'cost_scaling_factor': 3.0}

FIRST_DRIVE = """
import sys, time
sys.path[:0] = [{source!r}, {tests!r}]
from navigation_simulation import *
shapes = read_shapes('hallway')
grid = rasterise(shapes, (-17.0, -4.0), (17.0, 4.0))
cast(0.0, 0.0, 0.0, 8, shapes.segments, shapes.circles)
started = time.perf_counter()
loop = ClosedLoop(shapes, grid, Pose2D(-10.0, 0.0, 0.0))
loop.navigator.set_goal(Pose2D(10.0, 0.0, 0.0))
loop.step()
print(time.perf_counter() - started)
"""


def best_ms(work: Callable[[], Any], repeats: int = 30) -> float:
    """Return the best time of a call [ms], the one least disturbed by other processes."""
    work()
    times_s = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - started)
    return 1e3 * min(times_s)


def main() -> None:
    """Print all tables."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument('--skip-compile', action='store_true', help='leave out the first start from an empty cache')
    skips_compile = arguments.parse_args().skip_compile
    print_header('Navigation: best times of 30 calls')
    if not skips_compile:
        print(_table([_compile_row(name) for name in ('empty cache', 'warm cache')], ['first step of a process', 's']))
    print(_table(_dwa_rows(), ['DWA cycle', 'samples', 'ms']))
    print(_table(_costmap_rows(), ['costmap', 'cells', 'update [ms]', 'with its costs [ms]']))
    print(_table(_distance_rows(), ['distance transform', 'limit [cells]', 'ms', 'ns a cell']))
    print(_table(_plan_rows(), ['global plan', 'method', 'points', 'ms']))
    print(_table(_step_rows(), ['navigator, a control period of 50 ms', 'ms']))


def _table(rows: List[List[Any]], headers: List[str]) -> str:
    return tabulate(rows, headers, floatfmt='.3f') + '\n'


_CACHE = tempfile.TemporaryDirectory()


def _compile_row(name: str) -> List[Any]:
    """Return the seconds until a new process has driven its first step; all processes have one cache folder."""
    script = FIRST_DRIVE.format(source=str(ROOT / 'src'), tests=str(ROOT / 'test' / 'support'))
    done = subprocess.run(
        [sys.executable, '-c', script],
        stdout=subprocess.PIPE,
        check=True,
        env={**os.environ, 'NUMBA_CACHE_DIR': str(Path(_CACHE.name))},
    )
    return [name, float(done.stdout)]


def _local_costmap(**changes: object) -> Costmap:
    """Return a window around POSE that has seen one scan, in a frame equal to the map."""
    costmap = Costmap(local_defaults(**{**WIDE, **changes}))
    costmap.update(POSE, Robot(read_shapes('ros_logo'), POSE).scan(), POSE.compose(LASER_IN_BASE))
    return costmap


def _dwa_rows() -> List[List[Any]]:
    variants: List[Dict[str, Any]] = [
        {},
        {'vx_samples': 6},
        {'vx_samples': 12},
        {'vx_samples': 20, 'vth_samples': 40},
        {'sim_time': 0.85},
        {'sim_time': 3.4},
        {'use_dwa': False},
    ]
    costmap = _local_costmap(width=6.0, height=6.0)
    return [_dwa_row('upstream samples, 3 x 3 m', _local_costmap(), {})] + [
        _dwa_row('6 x 6 m' + ''.join(f', {key} {value}' for key, value in change.items()), costmap, change)
        for change in variants
    ]


def _dwa_row(name: str, costmap: Costmap, change: Dict[str, Any]) -> List[Any]:
    planner = DwaPlanner(DwaParams.from_mapping({**TABLE_2, **change}, ''), PERIOD_S)
    distance = np.arange(0.0, 1.4, 0.025)
    plan = np.column_stack([POSE.x_m + distance, np.full_like(distance, POSE.y_m), np.zeros_like(distance)])
    milliseconds = best_ms(lambda: planner.find_best(POSE, 0.42, 0.0, costmap, plan))
    assert planner.last_task is not None
    return [name, len(score_all(planner.last_task)[0]), milliseconds]


def _costmap_rows() -> List[List[Any]]:
    shapes = read_shapes('ros_logo')
    scan = Robot(shapes, POSE).scan()
    thousand = scan._replace(
        angle_increment_rad=scan.angle_increment_rad * 0.36,
        ranges_m=np.interp(np.arange(1000) * 0.36, np.arange(360), scan.ranges_m),
    )
    rows = []
    for size_m in (3.0, 6.0, 12.0):
        costmap = Costmap(local_defaults(width=size_m, height=size_m, **WIDE))
        rows.append([f'local {size_m:g} x {size_m:g} m, 1000 rays', costmap.costs.size, *_update_ms(costmap, thousand)])
    for resolution_m in (0.05, 0.025):
        grid = rasterise(shapes, (-6.5, -6.5), (7.0, 6.5), resolution_m)
        params = CostmapParams.from_mapping(WIDE, '')
        costmap = Costmap(params, grid)
        rows.append([f'global at {resolution_m} m, 1000 rays', costmap.costs.size, *_update_ms(costmap, thousand)])
        rows.append([f'global at {resolution_m} m, all new', costmap.costs.size, *_new_ms(params, grid)])
    return rows


def _update_ms(costmap: Costmap, scan: Any) -> Tuple[float, float]:
    """Return the time of an update alone, and of one whose costs are read: inflation waits for that."""

    def update() -> Costmap:
        costmap.update(POSE, scan, POSE.compose(LASER_IN_BASE))
        return costmap

    return best_ms(update), best_ms(lambda: update().costs)


def _new_ms(params: CostmapParams, grid: OccupancyGrid) -> Tuple[float, float]:
    return best_ms(lambda: Costmap(params, grid)), best_ms(lambda: Costmap(params, grid).costs)


def _distance_rows() -> List[List[Any]]:
    rows = []
    for side in (60, 120, 250, 500, 1000):
        for limit in (11, 20):
            is_obstacle = np.random.default_rng(0).random((side, side)) < 0.01
            milliseconds = best_ms(lambda: squared_distances(is_obstacle, limit), 10)
            rows.append([f'{side} x {side}, 1 % obstacles', limit, milliseconds, 1e6 * milliseconds / side**2])
    return rows


def _plan_rows() -> List[List[Any]]:
    rows = []
    for world, low, high, start, goal in (
        ('hallway', (-17.0, -4.0), (17.0, 4.0), Pose2D(-10, 0, 0), Pose2D(10, 0, 0)),
        ('ros_logo', (-6.5, -6.5), (7.0, 6.5), Pose2D(-2.8, -2.8, 0), Pose2D(2.8, 2.8, 0)),
    ):
        for resolution_m in (0.05, 0.025):
            grid = rasterise(read_shapes(world), low, high, resolution_m)
            costmap = Costmap(CostmapParams.from_mapping(WIDE, ''), grid)
            for method in ('Dijkstra', 'A*'):
                planner = GlobalPlanner(NavfnParams(use_dijkstra=method == 'Dijkstra'), costmap)
                points = len(planner.make_plan(start, goal))
                rows.append(
                    [
                        f'{world}, {costmap.costs.size} cells',
                        method,
                        points,
                        best_ms(lambda: planner.make_plan(start, goal), 10),
                    ]
                )
    return rows


def _step_rows() -> List[List[Any]]:
    """Return rows over a drive of 10 s, without scan casting and kinematics of the test robot."""
    shapes = read_shapes('hallway')
    grid = rasterise(shapes, (-17.0, -4.0), (17.0, 4.0))
    loop = ClosedLoop(shapes, grid, Pose2D(-10.0, 0.0, 0.0), params=navigator_params())
    loop.navigator.set_goal(Pose2D(10.0, 0.0, 0.0))
    loop.step()
    spent_s, step = [], loop.navigator.step

    def timed(now_ns: int) -> Any:
        started = time.perf_counter()
        output = step(now_ns)
        spent_s.append(time.perf_counter() - started)
        return output

    loop.navigator.step = timed  # type: ignore[method-assign]
    loop.run(10.0)
    return [
        ['median', 1e3 * float(np.median(spent_s))],
        ['mean', 1e3 * float(np.mean(spent_s))],
        ['highest', 1e3 * max(spent_s)],
        ['ms per second of robot time', 20.0 * 1e3 * float(np.mean(spent_s))],
    ]


if __name__ == '__main__':
    main()
