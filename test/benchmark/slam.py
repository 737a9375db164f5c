#!/usr/bin/env python3
"""Measure grid SLAM: time and memory by particles and rays, and the accuracy of its maps.

Drives of the simulated robot through both shipped worlds, 10 scans a second of 1000 rays. Of the
map: occupied cells that are within a cell of a true surface, and the visible surface that has an
occupied cell within a cell. Of the path: the absolute error after the first poses are aligned.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Dict, List, Tuple

import numpy as np
from checkout import ROOT, first_call_s, print_header
from counts import COUNT
from tabulate import tabulate

sys.path.insert(0, str(ROOT / 'test' / 'support'))

from diff_encoder_sim.localization.grid_slam import GridSlam, warm_up
from diff_encoder_sim.localization.slam_params import GridSlamParams
from patch_memory import memory_bytes, unshared_patch_count
from slam_drives import HALLWAY, MAPPING, PPRS, ROS_LOGO, Case, shipped_tour

PARTICLES, SKIPS = (5, 15, 30, 60), (9, 4, 1, 0)
SENSORS = [('ideal', 'fine')] + [(f'{ppr}', 'coarse') for ppr in PPRS]
MEGABYTE = 1e6
BYTES_PER_CELL = 16
MEASURES = ['correct [%]', 'mapped [%]', 'path error [mm]', 'bias x [mm]', 'bias y [mm]']


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    if arguments.table == 'seeds':
        _print_seeds(arguments)
        return
    print_header('Grid SLAM, one thread, processor time')
    _print_compile_time()
    warm_up(GridSlamParams())
    cases = {tour.world: Case(tour) for tour in (HALLWAY, ROS_LOGO)}
    rays = [f'{math.ceil(1000 / (skip + 1))} matched' for skip in SKIPS]
    for title, headers, rows in (
        (
            'ms for a scan that is entered into the map, hallway, 1000 rays entered',
            ['particles'] + rays,
            lambda: _by_size(cases['hallway'], arguments.scans),
        ),
        (
            'memory of the maps on the way, 30 particles, hallway, ideal odometry',
            ['known [m^2]', 'shared\n[MB]', 'each its own\npatches [MB]', 'whole grids\n[MB]'],
            lambda: _by_map(cases['hallway']),
        ),
        (
            (
                f'accuracy, {arguments.particles} particles: median and worst of {arguments.seeds} seeds; ideal '
                'odometry with 1 cm, the others with 3 cm of range noise'
            ),
            ['world', 'odometry', 'correct [%]', 'surface\nmapped [%]', 'path error\n[mm]', 'faster than\nreal time'],
            lambda: _accuracy(cases, arguments),
        ),
    ):
        print(f'\n{title}\n', flush=True)
        print(tabulate(rows(), headers, disable_numparse=True, stralign='right'), flush=True)
    print(
        f'\nScans are entered each {MAPPING["linearUpdate"]} m or '
        f'{MAPPING["angularUpdate"]} rad; others cost nothing. Correct: within a cell of a cell '
        'that a surface touches.'
    )


def _print_seeds(arguments: argparse.Namespace) -> None:
    """Print each map of --seeds drives over both tours of both worlds, and the worst and median of each."""
    tours = [(world, name) for world in ('hallway', 'ros_logo') for name in ('shipped', 'other')]
    jobs = [(*tour, seed, arguments.particles) for tour in tours for seed in range(1, arguments.seeds + 1)]
    by_cell: Dict[Tuple[str, ...], List[np.ndarray]] = {}
    with ProcessPoolExecutor(arguments.workers, multiprocessing.get_context('spawn')) as pool:
        for job, measures in zip(jobs, pool.map(_measure_seed, jobs)):
            for sensors, values in measures.items():
                by_cell.setdefault((job[0], job[1], sensors), []).append(values)
                print(*job[:3], sensors, *(f'{value:.2f}' for value in values), flush=True)
    for title, pick in (('worst', _worst), ('median', lambda values: np.median(np.abs(values), axis=0))):
        rows = [[*cell, *(f'{value:.1f}' for value in pick(np.array(values)))] for cell, values in by_cell.items()]
        print(f'\n{title} of {arguments.seeds} seeds\n')
        print(tabulate(rows, ['world', 'tour', 'sensors', *MEASURES], disable_numparse=True, stralign='right'))


def _measure_seed(job: Tuple[str, str, int, int]) -> Dict[str, np.ndarray]:
    """Record a drive and map it with both sets of sensors: MEASURES of each. The seed is both noise's and SLAM's."""
    world, name, seed, particles = job
    other = {'hallway': HALLWAY, 'ros_logo': ROS_LOGO}[world]
    case = Case(shipped_tour(world) if name == 'shipped' else other, (40,), seed)
    measures = {}
    for odometry, scans in (('ideal', 'fine'), ('40', 'coarse')):
        accuracy, error, _, _, bias_m = case.map(odometry, scans, seed, particles=particles)
        percent = 100.0 * np.array([accuracy.correct_fraction, accuracy.mapped_fraction])
        measures[f'{odometry}/{scans}'] = np.concatenate([percent, 1e3 * np.array([error.ate_rmse_m, *bias_m])])
    return measures


def _worst(values: np.ndarray) -> np.ndarray:
    """Return the worst of each column of MEASURES: the least of the first two, the farthest from 0 of the others."""
    farthest = np.abs(values).argmax(axis=0)
    return np.concatenate([values[:, :2].min(axis=0), values[farthest, np.arange(5)][2:]])


def _by_size(case: Case, scans: int) -> List[List[str]]:
    return [
        [f'{particles}'] + [f'{_scan_ms(case, particles, skip, scans):.1f}' for skip in SKIPS]
        for particles in PARTICLES
    ]


def _scan_ms(case: Case, particles: int, skip: int, scans: int) -> float:
    """Return the median over the scans entered, but for the first."""
    slam = GridSlam(GridSlamParams(**{**MAPPING, 'particles': particles, 'lskip': skip}), np.random.default_rng(0))
    costs_ms: List[float] = []
    for odom_pose, scan in zip(case.drive.odometry['ideal'], case.drive.scans['fine']):
        began_s = time.process_time()
        if slam.update(odom_pose, scan, case.drive.laser_pose_in_base) is not None:
            costs_ms.append(1e3 * (time.process_time() - began_s))
        if len(costs_ms) > scans:
            break
    return float(np.median(costs_ms[1:]))


def _by_map(case: Case) -> List[List[str]]:
    """List memory at quarters of the drive; whole grids are rectangles around what is known."""
    params = GridSlamParams(**MAPPING)
    slam, rows = GridSlam(params, np.random.default_rng(0)), []
    count = len(case.drive.true_poses)
    for index, (odom_pose, scan) in enumerate(zip(case.drive.odometry['ideal'], case.drive.scans['fine']), 1):
        slam.update(odom_pose, scan, case.drive.laser_pose_in_base)
        if index in (1, count // 8, count // 4, count // 2, count):
            known = np.argwhere(slam.map().cells >= 0)
            height, width = known.max(axis=0) - known.min(axis=0) + 1
            patch_bytes = slam.maps.cells[0].nbytes
            rows.append(
                [
                    f'{len(known) * params.delta**2:.0f}',
                    f'{memory_bytes(slam.maps) / MEGABYTE:.1f}',
                    f'{unshared_patch_count(slam.maps) * patch_bytes / MEGABYTE:.1f}',
                    f'{params.particles * height * width * BYTES_PER_CELL / MEGABYTE:.1f}',
                ]
            )
    return rows


def _accuracy(cases, arguments: argparse.Namespace) -> List[List[str]]:
    rows = []
    for world, case in cases.items():
        for odometry, scans in SENSORS:
            results = [
                case.map(odometry, scans, seed, particles=arguments.particles) for seed in range(arguments.seeds)
            ]
            correct = [100.0 * accuracy.correct_fraction for accuracy, *_ in results]
            mapped = [100.0 * accuracy.mapped_fraction for accuracy, *_ in results]
            off_mm = [1e3 * error.ate_rmse_m for _, error, *_ in results]
            speed = [case.drive.duration_s / spent_s for _, _, _, spent_s, _ in results]
            rows.append(
                [
                    world,
                    odometry,
                    f'{np.median(correct):.1f}, {min(correct):.1f}',
                    f'{np.median(mapped):.1f}, {min(mapped):.1f}',
                    f'{np.median(off_mm):.0f}, {max(off_mm):.0f}',
                    f'{np.median(speed):.0f}, {min(speed):.0f}',
                ]
            )
    return rows


def _print_compile_time() -> None:
    """Time a new process from the mapper's construction to its second scan, cache empty and filled."""
    for state, spent_s in zip(('compiling', 'compiled'), first_call_s('slam', 'first_scans_s')):
        print(f'first scans in a new process, {state}: {spent_s:.2f} s')


def first_scans_s() -> float:
    """Time the mapper from its construction to its second scan."""
    began_s = time.perf_counter()
    warm_up(GridSlamParams())
    return time.perf_counter() - began_s


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--table', choices=['all', 'seeds'], default='all', help='seeds: each seed of both tours')
    parser.add_argument('--workers', type=COUNT, default=2, help='processes, for --table seeds')
    parser.add_argument('--scans', type=COUNT, default=30, help='of which the median time is taken')
    parser.add_argument('--seeds', type=COUNT, default=3, help='of each drive')
    parser.add_argument('--particles', type=COUNT, default=30, help='for the accuracy')
    return parser.parse_args()


if __name__ == '__main__':
    main()
