#!/usr/bin/env python3
"""Whether the covariance of fused wheels and gyroscope is honest (NEES), how good its heading is, and a step's time.

Drives of sampled lengths and speeds, wheel phases, bias and scale error, with slip of 1e-6 m^2/m; with --trials the
paper's tests, navigated in the simulator by the fused odometry.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import math
import os
import time
from typing import List, Tuple

import numpy as np
from bench import ALTO, CONFIG, ROOT, in_processes, parser, plan_of, print_header, print_table

from diff_encoder_sim.base.imu import ImuParams, imu_settings
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from fusion_drives import DRIVES, IMUS, End, end_of

PPRS = (20, 40, 90, 250, 1024, 4096)
ALLOWED, MOST_WORSE, MOST_US = (0.8, 1.25), 1.1, 30.0
LEGEND = """
NEES / 3: 1 is honest; above, the filter is surer than it may be; +-: two standard errors. Heading errors are root mean
squares at the end [degrees]; ratio: of the fused one to the better of wheels only and gyroscope only."""


def main() -> None:
    made = parser(__doc__, seeds=100, steps=1000, workers=os.cpu_count())
    made.add_argument('--drives', nargs='+', default=DRIVES, choices=DRIVES)
    made.add_argument('--imus', nargs='+', default=['none', *IMUS], choices=['none', *IMUS])
    made.add_argument('--ppr', nargs='+', type=float, default=PPRS)
    made.add_argument('--trials', type=int, default=0, help='navigate these numbers of trials of SMT and DLD instead')
    made.add_argument('--slip', type=float, default=0.0, help='variance of the slip in trials [m^2/m]')
    arguments = made.parse_args()
    if arguments.trials:
        _print_trials(arguments)
        return
    print_header(f'Fusion of wheels and gyroscope, {arguments.seeds} seeds')
    gyro_us, counts_us = _step_us(arguments.steps)
    print_table([['rate', gyro_us], ['counts', counts_us], ['allowed', MOST_US]], ['step', 'us'])
    cells = list(itertools.product(arguments.drives, arguments.imus, arguments.ppr))
    found = in_processes(functools.partial(_ends, arguments.seeds), cells, arguments.workers)
    rows = [[*cell[:2], f'{cell[2]:g}', *_row(ends)] for cell, ends in zip(cells, found)]
    heads = ['drive', 'IMU', 'counts', 'NEES / 3', '+-', 'of yaw', 'fused', 'wheels', 'gyro', 'ratio', 'allowed']
    print_table(rows, heads, 2)
    print(LEGEND)


def _print_trials(arguments: argparse.Namespace) -> None:
    print_header(f'Fusion in navigated tests, {arguments.trials} trials, slip {arguments.slip:g} m^2/m')
    cells = list(itertools.product(('SMT', 'DLD'), arguments.imus, arguments.ppr))
    jobs = [(*cell, number) for cell in cells for number in range(1, arguments.trials + 1)]
    found = np.array(in_processes(functools.partial(_end_of_trial, arguments.slip), jobs, arguments.workers))
    means = found.reshape(len(cells), arguments.trials, -1).mean(axis=1)
    means[:, 2] = np.degrees(np.sqrt(means[:, 2]))
    rows = [[*cell[:2], f'{cell[2]:g}', *(f'{each:.3f}' for each in mean)] for cell, mean in zip(cells, means)]
    print_table(rows, ['test', 'IMU', 'counts', 'NEES / 3', 'of yaw', 'heading [deg]'], 2)


def _end_of_trial(slip: float, job: Tuple[str, str, float, int]) -> Tuple[float, float, float]:
    """Return NEES / 3, that of the heading, and the squared heading error [rad^2] at the end of a trial."""
    test, imu, ppr, number = job
    settings = {'simulator.wheel_errors.slip_noise': slip, **imu_settings(imu, CONFIG, ROOT)}
    plan = plan_of(test, ppr, number)
    fusion = 'none' if imu == 'none' else 'embedded'
    plan = plan.model_copy(update={'trial': plan.trial.model_copy(update={'fusion': fusion})})
    *_, last = LockstepTrial(plan, ALTO, override(load_robot_config(CONFIG), settings)).run()
    true = last.true_pose_in_map.relative_to(plan.trial.test.start.pose())
    error = np.subtract(last.odometry.base_pose_in_odom, true)
    error[2] = wrap_angles(error[2])
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = last.odometry.of_pose
    covariance = np.array([[xx, xy, x_yaw], [xy, yy, y_yaw], [x_yaw, y_yaw, yaw_yaw]])
    nees = float(error @ np.linalg.solve(covariance, error)) / 3.0
    return nees, error[2] ** 2 / yaw_yaw, error[2] ** 2


def _ends(seeds: int, cell: Tuple[str, str, float]) -> List[End]:
    drive, imu, ppr = cell
    return [end_of(drive, ppr, IMUS.get(imu), seed) for seed in range(seeds)]


def _row(ends: List[End]) -> List[str]:
    every = np.array(ends)
    nees, error = every[:, 0].mean(), 2.0 * every[:, 0].std() / math.sqrt(len(ends))
    fused, wheels, gyro = np.degrees(np.sqrt(np.mean(every[:, 2:] ** 2, axis=0)))
    ratio = fused / min(wheels, gyro)
    allowed = ('' if ALLOWED[0] <= nees <= ALLOWED[1] else 'NEES ') + ('' if ratio <= MOST_WORSE else 'ratio')
    return [f'{each:.2f}' for each in (nees, error, every[:, 1].mean())] + [
        *(f'{each:.3f}' for each in (fused, wheels, gyro, ratio)),
        allowed or 'yes',
    ]


def _step_us(steps: int) -> Tuple[float, float]:
    """Return the processor time of a step with a rate, and of one with counts, through the methods: best of 10."""
    filter_ = WheelGyroFilter(FusionParams(), WheelErrors((0.01, 0.01), 0.4), ImuParams())
    filter_.take_counts(0, 0, 0)
    filter_.take_gyro(1, 0.0)
    best_s = [math.inf, math.inf]
    for first in range(0, 10 * steps, steps):
        spent_s = [0.0, 0.0]
        for step in range(first + 1, first + steps + 1):
            begin_s = time.process_time()
            filter_.take_gyro(10_000_000 * step, 0.1)
            middle_s = time.process_time()
            filter_.take_counts(10_000_000 * step, 3 * step, 4 * step)
            spent_s[0] += middle_s - begin_s
            spent_s[1] += time.process_time() - middle_s
        best_s = [min(best, spent / steps) for best, spent in zip(best_s, spent_s)]
    return 1e6 * best_s[0], 1e6 * best_s[1]


if __name__ == '__main__':
    main()
