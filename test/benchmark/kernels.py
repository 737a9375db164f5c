#!/usr/bin/env python3
"""What the hot loops take, one thread: a scan, AMCL's update, a DWA cycle, a costmap's update, a global plan.

Each is the best of several rounds. Ratios are those to a scan of 1000 rays in the hallway, measured in the same run.
"""

from __future__ import annotations

import time
from typing import Callable, Dict, List

import numpy as np
from bench import ROOT, Ratio, parser, print_header, print_table, report_ratios

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.global_planner import GlobalPlanner
from diff_encoder_sim.navigation.navigator_params import DwaParams, NavfnParams
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.world import load_world
from navigation_simulation import LASER_IN_BASE, TABLE_2, Robot, shipped_world

SCAN, SCAN_HEIGHT_M = 'scan of 1000 rays, hallway', 0.3
NEAR_A_PILLAR, START, GOAL = Pose2D(-1.9, -0.935, 0.0), Pose2D(-10.0, 0.0, 0.0), Pose2D(10.0, 0.0, 0.0)


def main() -> None:
    arguments = parser(__doc__, has_ratios=True, repeats=30).parse_args()
    print_header(f'Hot loops: best of {arguments.repeats} rounds')
    rounds_ms = {name: _rounds_ms(work, arguments.repeats) for name, work in _works().items()}
    print_table([[name, f'{min(each):.3f}'] for name, each in rounds_ms.items()], ['', 'ms'])
    scan_ms = min(rounds_ms[SCAN])
    ratios = [Ratio(name, SCAN, [each / scan_ms for each in rounds]) for name, rounds in rounds_ms.items()]
    report_ratios(arguments, ratios)


def _works() -> Dict[str, Callable[[], object]]:
    lidar = Lidar(load_world(ROOT / 'worlds' / 'hallway.world'), SCAN_HEIGHT_M, LidarParams(), np.random.default_rng(0))
    grid = load_map(ROOT / 'worlds' / 'hallway.yaml')
    beams = Lidar(
        load_world(ROOT / 'worlds' / 'hallway.world'), SCAN_HEIGHT_M, LidarParams(samples=180), np.random.default_rng(0)
    )
    fixed = {'min_particles': 3000, 'max_particles': 3000, 'laser_max_beams': 180, 'resample_interval': 1}
    amcl = Amcl(AmclParams(initial_pose_x=START.x_m, **fixed), grid, np.random.default_rng(0))
    scan = beams.scan(0, START)

    def update() -> None:
        amcl.request_nomotion_update()
        amcl.update(IDENTITY, scan, IDENTITY)

    local = Costmap(local_defaults(inflation_radius=1.0, cost_scaling_factor=3.0))
    seen, laser = Robot(shipped_world('ros_logo')[0], NEAR_A_PILLAR).scan(), NEAR_A_PILLAR.compose(LASER_IN_BASE)

    def see() -> object:
        local.update(NEAR_A_PILLAR, seen, laser)
        return local.costs

    see()
    planner, distances_m = DwaPlanner(DwaParams.from_mapping(TABLE_2, ''), 0.05), np.arange(0.0, 1.4, 0.025)
    straight = np.column_stack(
        [NEAR_A_PILLAR.x_m + distances_m, np.full_like(distances_m, NEAR_A_PILLAR.y_m), np.zeros_like(distances_m)]
    )
    plans = GlobalPlanner(NavfnParams(), Costmap(CostmapParams(), grid))
    return {
        SCAN: lambda: lidar.scan(0, START),
        "AMCL's update, 3000 particles x 180 beams, resampled": update,
        'DWA cycle, 3 x 20 samples': lambda: planner.find_best(NEAR_A_PILLAR, 0.42, 0.0, local, straight),
        'local costmap with its costs, 3 x 3 m': see,
        'global plan, hallway': lambda: plans.make_plan(START, GOAL),
    }


def _rounds_ms(work: Callable[[], object], repeats: int) -> List[float]:
    work()  # compiles
    found = []
    for _ in range(repeats):
        began_s = time.process_time()
        work()
        found.append(1e3 * (time.process_time() - began_s))
    return found


if __name__ == '__main__':
    main()
