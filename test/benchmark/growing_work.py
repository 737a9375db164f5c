"""What growth.py measures: each function prepares work of a size, and returns it."""

from __future__ import annotations

import contextlib
import io
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Callable, Dict, List

import numpy as np
from checkout import ROOT
from made_up_results import make_results
from plans import plan_of

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries, wrap_angle
from diff_encoder_sim.drives.test_definition import Segment, TestDefinition
from diff_encoder_sim.drives.trajectory_error import Alignment, path_error
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.map_files import load_map, save_map
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, NavfnParams
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import Box, Model, Solid, World
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.trials.trial_run import run_trial

Work = Callable[[], object]

RESOLUTION_M, SCAN_HEIGHT_M = 0.1, 0.3  # finer, a map of 500 m would be more pixels than map files may have
PILLARS_APART_M, PILLAR_M = 5.0, 0.4
POSE_PERIOD_NS, SPEED_MPS = 50_000_000, 0.45
STRETCH_M = 10.0  # 10 km of them are as many segments as a drive may have
ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'

# Folders of prepared files, for as long as the process lives.
_kept = contextlib.ExitStack()


def reading_a_map(side_m: int) -> Work:
    """Read a map's file."""
    path = save_map(_grid(side_m), _folder() / 'map')
    return lambda: load_map(path)


def rasterising(side_m: int) -> Work:
    """Make a map of a world."""
    world = _world(side_m)
    return lambda: rasterise(world, SCAN_HEIGHT_M, RESOLUTION_M, 0.0, 0.0)


def likelihood_field(side_m: int) -> Work:
    """Give AMCL a map."""
    amcl, grid = Amcl(AmclParams(), _grid(5), np.random.default_rng(0)), _grid(side_m)
    return lambda: amcl.set_map(grid)


def global_costmap(side_m: int) -> Work:
    """Inflate a map."""
    grid = _grid(side_m)
    return lambda: Costmap(CostmapParams(), grid).costs


def global_plan(side_m: int) -> Work:
    """Plan from one corner of a map to the other."""
    planner = GlobalPlanner(NavfnParams(), Costmap(CostmapParams(), _grid(side_m)))
    corner_m = 0.5 * side_m - 1.0
    start, goal = Pose2D(-corner_m, -corner_m, 0.0), Pose2D(corner_m, corner_m, 0.0)
    return lambda: planner.make_plan(start, goal)


def scanning(side_m: int) -> Work:
    """Cast a scan in a world of that size."""
    lidar = Lidar(_world(side_m), SCAN_HEIGHT_M, LidarParams(), np.random.default_rng(0))
    return lambda: [lidar.scan(0, IDENTITY) for _ in range(20)]


def weighing_particles(particles: int) -> Work:
    """Update AMCL with so many particles and 180 beams."""
    return _updating(particles, 180)


def weighing_beams(beams: int) -> Work:
    """Update AMCL with 3000 particles and so many beams."""
    return _updating(3000, beams)


def driving(length_m: int) -> Work:
    """Run a trial to and fro in the hallway, without feedback, with its bag."""
    stretches = [Segment(straight=STRETCH_M * (-1) ** number) for number in range(round(length_m / STRETCH_M))]
    test = TestDefinition(name='to_and_fro', world='hallway', drive=stretches)
    plan, params = plan_of('SL', 90, 1, 'scripted', str(_folder() / 'trial.bag')), load_robot_params(ROOT / 'config')
    plan = plan.model_copy(update={'trial': plan.trial.model_copy(update={'test': test})})
    return lambda: run_trial(plan, ROBOT, params, 'minimal')


def comparing_paths(length_m: int) -> Work:
    """Compute the errors along a path: ATE, and both RPEs."""
    count = round(length_m / SPEED_MPS * 1e9 / POSE_PERIOD_NS)
    stamps_ns = POSE_PERIOD_NS * np.arange(count, dtype=np.int64)
    yaws_rad = np.cumsum(np.random.default_rng(0).normal(0.0, 0.02, count))
    steps_m = length_m / count * np.column_stack([np.cos(yaws_rad), np.sin(yaws_rad)])
    true = PoseSeries(stamps_ns, np.column_stack([np.cumsum(steps_m, axis=0), wrap_angle(yaws_rad)]))
    estimate = PoseSeries(stamps_ns, true.x_y_yaw + [0.1, 0.0, 0.0])
    return lambda: path_error(estimate, true, Alignment.ORIGIN)


def trivial_trials(trials: int) -> Work:
    """Run a campaign of trials that do nothing but write a bag of a few kB, on one worker; client and worker count."""
    folder = _folder()
    search = [str(ROOT / 'test'), *filter(None, sys.path)]
    found = {**os.environ, 'PYTHONPATH': os.pathsep.join(search), 'CAMPAIGN_TRIALS_FOLDER': str(folder)}
    words = ['--config', 'paper', '--tests', 'SL', '--ppr', '90', '--workers', '1', '--trials', str(trials)]
    command = [sys.executable, str(ROOT / 'test' / 'campaign_trials.py'), *words, '--out', str(folder / 'out')]
    return lambda: _run_quietly(command, found)


def resuming(trials: int) -> Work:
    """Open a campaign's results folder, in which all trials are finished."""
    folder = _results(trials)
    campaign = load_campaign('paper', ROOT, {'trials': _per_cell(trials), 'record': 'none'})
    return lambda: ResultStore(folder, campaign, {}).finish()


def analysing(trials: int) -> Work:
    """Run analyze on a trials.csv of the paper's cells, its start included, as a process of its own."""
    folder, out = _results(trials), _folder() / 'analysis'
    command = [sys.executable, str(ROOT / 'scripts' / 'analyze'), str(folder), '--out', str(out)]
    found = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
    return lambda: _run_quietly(command, found)


def remove_files() -> None:
    """Remove what was prepared."""
    _kept.close()


def _run_quietly(command: List[str], environment: Dict[str, str]) -> None:
    quiet = subprocess.DEVNULL
    subprocess.run(command, check=True, stdout=quiet, stderr=quiet, env=environment)


def _results(trials: int) -> Path:
    folder = _folder() / 'results'
    with contextlib.redirect_stdout(io.StringIO()):
        make_results(folder, _per_cell(trials))
    return folder


def _per_cell(trials: int) -> int:
    return math.ceil(trials / 12)  # three tests, four encoders


def _updating(particles: int, beams: int) -> Work:
    fixed = {'min_particles': particles, 'max_particles': particles, 'laser_max_beams': beams}
    amcl = Amcl(AmclParams(**fixed), _grid(20), np.random.default_rng(0))
    ranges_m = np.random.default_rng(1).uniform(0.5, 3.0, beams)
    scan = Scan(0, -math.pi, 2.0 * math.pi / beams, 0.1, 6.0, ranges_m)

    def update() -> None:
        for _ in range(100):
            amcl.request_nomotion_update()
            amcl.update(IDENTITY, scan, IDENTITY)

    return update


def _grid(side_m: int) -> OccupancyGrid:
    """Return a square map around the origin: a wall about it, and a pillar in each 5 m square."""
    cells = round(side_m / RESOLUTION_M)
    grid = np.full((cells, cells), FREE, np.int8)
    grid[[0, 1, -2, -1]], grid[:, [0, 1, -2, -1]] = OCCUPIED, OCCUPIED
    apart, wide = (round(length_m / RESOLUTION_M) for length_m in (PILLARS_APART_M, PILLAR_M))
    for row in range(wide):
        for column in range(wide):
            grid[apart // 2 + row :: apart, apart // 2 + column :: apart] = OCCUPIED
    return OccupancyGrid(grid, RESOLUTION_M, Pose2D(-0.5 * side_m, -0.5 * side_m, 0.0))


def _world(side_m: int) -> World:
    """Return the same as a world."""
    places_m = np.arange(0.5 * (PILLARS_APART_M - side_m), 0.5 * side_m, PILLARS_APART_M)
    solids = [_box(x_m, y_m, PILLAR_M, PILLAR_M) for x_m in places_m for y_m in places_m]
    for end_m in (-0.5 * side_m, 0.5 * side_m):
        solids += [_box(end_m, 0.0, 0.1, side_m), _box(0.0, end_m, side_m, 0.1)]
    return World('pillars', [Model('pillars', np.eye(4), solids)])


def _box(x_m: float, y_m: float, length_m: float, width_m: float) -> Solid:
    pose = np.eye(4)
    pose[:3, 3] = [x_m, y_m, 1.0]
    return Solid(f'{x_m}/{y_m}', Box((length_m, width_m, 2.0)), pose)


def _folder() -> Path:
    return Path(_kept.enter_context(tempfile.TemporaryDirectory()))
