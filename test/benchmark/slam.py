#!/usr/bin/env python3
"""Accuracy of grid SLAM's maps over seeds, with two tours of both shipped worlds, 10 scans a second of 1000 rays.

Correct: occupied cells within a cell of a cell that a surface touches. Mapped: visible surface with an occupied cell
within a cell. Path: absolute error after the first poses are aligned. The seed is that of the noise and of SLAM.
"""

from __future__ import annotations

from typing import Dict, List, Tuple

import numpy as np
from bench import in_processes, parser, print_header, print_table

from slam_drives import HALLWAY, ROS_LOGO, Case, shipped_tour

MEASURES = ['correct [%]', 'mapped [%]', 'path error [mm]', 'bias x [mm]', 'bias y [mm]']
Job = Tuple[str, str, int, int]  # world, tour, seed, particles


def main() -> None:
    options = parser(__doc__, seeds=20, particles=30, workers=2).parse_args()
    print_header(f'Grid SLAM, {options.seeds} seeds, {options.particles} particles')
    tours = [(world, name) for world in ('hallway', 'ros_logo') for name in ('shipped', 'other')]
    jobs = [(*tour, seed, options.particles) for tour in tours for seed in range(1, options.seeds + 1)]
    by_cell: Dict[Tuple[str, ...], List[np.ndarray]] = {}
    for job, measures in zip(jobs, in_processes(_measure, jobs, options.workers)):
        for sensors, values in measures.items():
            by_cell.setdefault((*job[:2], sensors), []).append(values)
            print(*job[:3], sensors, *(f'{value:.2f}' for value in values))
    for title, pick in (('worst', _worst), ('median', lambda values: np.median(np.abs(values), axis=0))):
        rows = [[*cell, *(f'{value:.1f}' for value in pick(np.array(values)))] for cell, values in by_cell.items()]
        print(f'\n{title} of {options.seeds} seeds\n')
        print_table(rows, ['world', 'tour', 'sensors', *MEASURES], 3)


def _measure(job: Job) -> Dict[str, np.ndarray]:
    """Record a drive and map it with both sets of sensors: MEASURES of each."""
    world, name, seed, particles = job
    other = {'hallway': HALLWAY, 'ros_logo': ROS_LOGO}[world]
    case = Case(shipped_tour(world) if name == 'shipped' else other, seed)
    measures = {}
    for odometry, scans in (('ideal', 'fine'), ('40', 'coarse')):
        accuracy, error, _, bias_m = case.map(odometry, scans, seed, particles=particles)
        percent = 100.0 * np.array([accuracy.correct_fraction, accuracy.mapped_fraction])
        measures[f'{odometry}/{scans}'] = np.concatenate([percent, 1e3 * np.array([error.ate_rmse_m, *bias_m])])
    return measures


def _worst(values: np.ndarray) -> np.ndarray:
    """Return the worst of each column of MEASURES: the least of the first two, the farthest from 0 of the others."""
    farthest = np.abs(values).argmax(axis=0)
    return np.concatenate([values[:, :2].min(axis=0), values[farthest, np.arange(5)][2:]])


if __name__ == '__main__':
    main()
