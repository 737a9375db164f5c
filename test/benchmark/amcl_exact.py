#!/usr/bin/env python3
"""AMCL and the exact Bayes filter of the same model on equal drives, with exact odometry and maps: how far AMCL's mean
is from the posterior's, over seeds of its particles, and whether the covariance that each states matches its error.
"""

from __future__ import annotations

import argparse
import math
from typing import Dict, List, NamedTuple, Tuple

import numpy as np
from bench import ROOT, parser, print_header, print_table

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world
from grid_filter import GridFilter

# Within the exact filter's window: what is measured does not depend on it.
NARROW_START = dict(initial_cov_xx=0.04, initial_cov_yy=0.04, initial_cov_aa=0.01)
UNITS = np.array([1e3, 1e3, math.degrees(1.0)])  # mm, mm, degrees

SCAN_HEIGHT_M, RESOLUTION_M = 1.12, 0.05

Drive = List[Tuple[Pose2D, Scan]]


class Place(NamedTuple):
    """A world, and how the robot moves in it from one update to the next."""

    world: str
    start: Pose2D
    forward_m: float
    turn_rad: float
    updates: int


SL = Place('hallway', Pose2D(-10.0, 0.0, 0.0), 0.21, 0.0, 94)
SMT = Place('ros_logo', Pose2D(-3.4, -0.85, 0.0), 0.0, 0.55, 57)


class Stated(NamedTuple):
    """What a filter states after an update."""

    mean: np.ndarray  # x [m], y [m], yaw [rad]
    sigmas: np.ndarray  # of the same


def main() -> None:
    """Print the table."""
    arguments = parser(__doc__, updates=45, seeds=20, particles=3000).parse_args()
    print_header(f'AMCL against the exact filter, {arguments.updates} updates, the first third left out')
    rows = []
    for name, place in (('SL', SL), ('SMT', SMT)):
        rows += _rows(name, place, arguments)
    headers = ['test', 'filter', 'from the exact\nx, y [mm]', 'yaw\n[deg]', 'from the truth\nx, y [mm]', 'yaw\n[deg]']
    headers += ['states\nx, y [mm]', 'yaw\n[deg]', 'NEES / 3']
    print_table(rows, headers, 2)
    print(f'\nRoot mean squares; AMCL with {arguments.particles} particles, {arguments.seeds} seeds.')


def _scanner_and_map(place: Place, samples: int) -> Tuple[Lidar, OccupancyGrid]:
    world = load_world(ROOT / 'worlds' / f'{place.world}.world')
    lidar = Lidar(world, SCAN_HEIGHT_M, LidarParams(samples=samples), np.random.default_rng(1))
    return lidar, rasterise(world, SCAN_HEIGHT_M, RESOLUTION_M, place.start.x_m, place.start.y_m)


def _rows(name: str, place: Place, arguments: argparse.Namespace) -> List[List[str]]:
    lidar, grid = _scanner_and_map(place, 1000)
    drive, pose = [], place.start
    for _ in range(arguments.updates):
        drive.append((pose, lidar.scan(0, pose)))
        pose = pose.compose(Pose2D(place.forward_m, 0.0, place.turn_rad))
    params = _params(place, arguments.particles)
    exact = _exact(params, grid, drive)
    runs = {'exact': [exact]}
    runs['AMCL'] = [_amcl(params, grid, drive, seed) for seed in range(arguments.seeds)]
    return [[name, title, *_cells(found, exact, drive)] for title, found in runs.items()]


def _params(place: Place, particles: int) -> AmclParams:
    """Return the paper's parameters, with an estimate after each update and no draws over the whole map."""
    changes: Dict[str, float] = dict(
        max_particles=particles,
        min_particles=particles,
        resample_interval=1,
        recovery_alpha_slow=0.0,
        recovery_alpha_fast=0.0,
        initial_pose_x=place.start.x_m,
        initial_pose_y=place.start.y_m,
        **NARROW_START,
    )
    return AmclParams(**{**load_yaml(ROOT / 'config' / 'amcl.yaml'), **changes})


def _exact(params: AmclParams, grid: OccupancyGrid, drive: Drive) -> List[Stated]:
    exact, stated, previous = GridFilter(params, grid), [], None
    for pose, scan in drive:
        if previous is not None:
            exact.predict(previous, pose)
        exact.correct(scan)
        previous = pose
        stated.append(Stated(np.array(exact.mean()), exact.spread()))
    return stated


def _amcl(params: AmclParams, grid: OccupancyGrid, drive: Drive, seed: int) -> List[Stated]:
    amcl, stated = Amcl(params, grid, np.random.default_rng(seed)), []
    for pose, scan in drive:
        estimate = amcl.update(pose, scan, IDENTITY)
        stated.append(Stated(np.array(estimate.base_pose_in_map), np.sqrt(np.diag(estimate.covariance))))
    return stated


def _cells(runs: List[List[Stated]], exact: List[Stated], drive: Drive) -> List[str]:
    settled = slice(len(drive) // 3, None)
    truths = [np.array(pose) for pose, _ in drive[settled]]
    exact_means = [stated.mean for stated in exact[settled]]
    from_exact = _errors([run[settled] for run in runs], exact_means)
    from_truth = _errors([run[settled] for run in runs], truths)
    sigmas = np.array([[stated.sigmas for stated in run[settled]] for run in runs])
    nees = np.mean((from_truth / sigmas) ** 2)
    return [*_text(from_exact), *_text(from_truth), *_text(sigmas), f'{nees:.3f}']


def _errors(runs: List[List[Stated]], references: List[np.ndarray]) -> np.ndarray:
    """Return (runs, updates, 3) differences x [m], y [m], yaw [rad]."""
    errors = np.array([[stated.mean - reference for stated, reference in zip(run, references)] for run in runs])
    errors[..., 2] = np.vectorize(wrap_angle)(errors[..., 2])
    return errors


def _text(values: np.ndarray) -> Tuple[str, str]:
    x, y, yaw = np.sqrt(np.mean(values**2, axis=(0, 1))) * UNITS
    return f'{x:.1f}, {y:.1f}', f'{yaw:.2f}'


if __name__ == '__main__':
    main()
