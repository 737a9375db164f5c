#!/usr/bin/env python3
"""AMCL and the exact Bayes filter of the same model on equal drives, with exact odometry and maps: how far AMCL's mean
is from the posterior's, over seeds of its particles, and whether the covariance that each states matches its error.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple, Tuple

import numpy as np
from bench import ROOT, minus, parser, print_header, print_table

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
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


PLACES = {
    'SL': Place('hallway', Pose2D(-10.0, 0.0, 0.0), 0.21, 0.0, 94),
    'SMT': Place('ros_logo', Pose2D(-3.4, -0.85, 0.0), 0.0, 0.55, 57),
}


def main() -> None:
    arguments = parser(__doc__, updates=45, seeds=20, particles=3000).parse_args()
    print_header(f'AMCL against the exact filter, {arguments.updates} updates, the first third left out')
    rows = []
    for name, place in PLACES.items():
        drive, grid = _drive(place, arguments.updates)
        params = _params(place, arguments.particles)
        exact = _exact(params, grid, drive)
        amcl = np.array([_amcl(params, grid, drive, seed) for seed in range(arguments.seeds)])
        rows += [[name, 'exact', *_cells(exact[None], exact, drive)], [name, 'AMCL', *_cells(amcl, exact, drive)]]
    headers = ['test', 'filter', 'from the exact\nx, y [mm]', 'yaw\n[deg]', 'from the truth\nx, y [mm]', 'yaw\n[deg]']
    headers += ['states\nx, y [mm]', 'yaw\n[deg]', 'NEES / 3']
    print_table(rows, headers, 2)
    print(f'\nRoot mean squares; AMCL with {arguments.particles} particles, {arguments.seeds} seeds.')


def _drive(place: Place, updates: int) -> Tuple[Drive, OccupancyGrid]:
    world = load_world(ROOT / 'worlds' / f'{place.world}.world')
    lidar = Lidar(world, SCAN_HEIGHT_M, LidarParams(samples=1000), np.random.default_rng(1))
    drive, pose = [], place.start
    for _ in range(updates):
        drive.append((pose, lidar.scan(0, pose)))
        pose = pose.compose(Pose2D(place.forward_m, 0.0, place.turn_rad))
    return drive, rasterise(world, SCAN_HEIGHT_M, RESOLUTION_M, place.start.x_m, place.start.y_m)


def _params(place: Place, particles: int) -> AmclParams:
    """Return the paper's parameters, with an estimate after each update and no draws over the whole map."""
    counts = dict(max_particles=particles, min_particles=particles, resample_interval=1)
    start = dict(initial_pose_x=place.start.x_m, initial_pose_y=place.start.y_m, **NARROW_START)
    changes = dict(**counts, recovery_alpha_slow=0.0, recovery_alpha_fast=0.0, **start)
    return AmclParams(**{**load_yaml(ROOT / 'config' / 'amcl.yaml'), **changes})


def _exact(params: AmclParams, grid: OccupancyGrid, drive: Drive) -> np.ndarray:
    """Return mean and standard deviations of x [m], y [m], yaw [rad] after each update: (updates, 2, 3)."""
    exact, stated, previous = GridFilter(params, grid), [], None
    for pose, scan in drive:
        if previous is not None:
            exact.predict(previous, pose)
        exact.correct(scan)
        previous = pose
        stated.append((exact.mean(), exact.spread()))
    return np.array(stated)


def _amcl(params: AmclParams, grid: OccupancyGrid, drive: Drive, seed: int) -> np.ndarray:
    amcl = Amcl(params, grid, np.random.default_rng(seed))
    estimates = [amcl.update(pose, scan, IDENTITY) for pose, scan in drive]
    return np.array([(each.base_pose_in_map, np.sqrt(np.diag(each.covariance))) for each in estimates])


def _cells(runs: np.ndarray, exact: np.ndarray, drive: Drive) -> List[str]:
    """Return the columns of (runs, updates, 2, 3) means and standard deviations."""
    settled = slice(len(drive) // 3, None)
    means, sigmas = np.moveaxis(runs[:, settled], 2, 0)
    from_exact = minus(means, exact[settled, 0])
    from_truth = minus(means, np.array([pose for pose, _ in drive[settled]]))
    nees = np.mean((from_truth / sigmas) ** 2)
    return [*_text(from_exact), *_text(from_truth), *_text(sigmas), f'{nees:.3f}']


def _text(values: np.ndarray) -> Tuple[str, str]:
    x, y, yaw = np.sqrt(np.mean(values**2, axis=(0, 1))) * UNITS
    return f'{x:.1f}, {y:.1f}', f'{yaw:.2f}'


if __name__ == '__main__':
    main()
