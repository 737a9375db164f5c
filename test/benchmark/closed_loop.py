#!/usr/bin/env python3
"""The paper's tests navigated in lockstep, by pulses per revolution: how many reach the goal, where
the pose estimate is and where the robot stands, and whether AMCL's covariance says so (NEES)."""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import time
from functools import partial
from typing import List, NamedTuple, Optional, Tuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from plans import plan_of
from tabulate import tabulate

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial, Report
from diff_encoder_sim.trials.robot_params import load_robot_params

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
CONFIG = ROOT / 'config'
XY_TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, 0.052
# A fraction of the estimates is enough: neighbours along the way are alike.
ESTIMATES_PER_TRIAL = 20


class Result(NamedTuple):
    """One trial."""

    failure: str  # '' when it reached its goal
    duration_s: float
    wall_s: float
    estimated_error: Optional[Pose2D]  # /global_pose in the goal's frame
    true_error: Optional[Pose2D]
    nees: List[float]  # of AMCL's estimates against the truth, each of 3 degrees


def run_trial(amcl: str, cell: Tuple[str, int, int]) -> Result:
    """One trial of (test, PPR, number) with AMCL's parameters of a file of config/."""
    name, ppr, number = cell
    plan = plan_of(name, ppr, number)
    amcl_file = CONFIG / f'{amcl}.yaml'
    params = load_robot_params(CONFIG)._replace(amcl=AmclParams.from_mapping(load_yaml(amcl_file), str(amcl_file)))
    loop = LockstepTrial(plan, ROBOT, params)
    begin_s, reports = time.perf_counter(), list(loop.run())
    last, goal = reports[-1], plan.trial.goal()
    estimated = last.estimated_pose_in_map
    return Result(
        loop.ending.reason,
        last.stamp_ns * 1e-9,
        time.perf_counter() - begin_s,
        estimated and estimated.relative_to(goal),
        last.true_pose_in_map.relative_to(goal),
        _nees(reports),
    )


def _nees(reports: List[Report]) -> List[float]:
    """Return the NEES of estimates as they came, each against the truth at its stamp."""
    truth = {report.stamp_ns: report.true_pose_in_map for report in reports}
    estimates = {report.estimate.stamp_ns: report.estimate for report in reports if report.estimate is not None}
    chosen = list(estimates.values())[:: max(1, len(estimates) // ESTIMATES_PER_TRIAL)]
    values = []
    for estimate in chosen:
        # In the map's axes, as the covariance is.
        here, true = estimate.base_pose_in_map, truth[estimate.stamp_ns]
        error = np.array(
            [here.x_m - true.x_m, here.y_m - true.y_m, math.remainder(here.yaw_rad - true.yaw_rad, 2.0 * math.pi)]
        )
        values.append(float(error @ np.linalg.solve(estimate.covariance, error)) / 3.0)
    return values


def main() -> None:
    """Run the cells and print the table."""
    arguments = _arguments()
    print_header(f'{arguments.trials} trials of each test and PPR in lockstep, {arguments.amcl}.yaml')
    cells = [
        (test, ppr, arguments.first + number)
        for test in arguments.tests
        for ppr in arguments.ppr
        for number in range(arguments.trials)
    ]
    with multiprocessing.Pool(arguments.workers) as pool:
        results = dict(zip(cells, pool.imap(partial(run_trial, arguments.amcl), cells)))
    rows = []
    for test in arguments.tests:
        for ppr in arguments.ppr:
            cell = {key: result for key, result in results.items() if key[:2] == (test, ppr)}
            rows.append([test, ppr, *_row(list(cell.values()))])
            for key, result in cell.items():
                if result.failure:
                    print(f'{key[0]} {key[1]} PPR trial {key[2]}: {result.failure}')
    print(
        tabulate(
            rows,
            [
                'test',
                'PPR',
                'reached',
                'time [s]\nmedian',
                'most',
                'within,\nestimated',
                'within,\ntrue',
                'estimated\nxy [mm]',
                'yaw [deg]',
                'true\nxy [mm]',
                'yaw [deg]',
                'NEES\nmean',
                'median',
                'x real\ntime',
            ],
            disable_numparse=True,
            stralign='right',
        )
    )
    print(
        f'\nWithin {XY_TOLERANCE_M} m and {math.degrees(YAW_TOLERANCE_RAD):.0f} degrees of the '
        f'goal; errors are root mean squares. NEES is divided by 3: 1 for a covariance that is '
        f'right, less for one that is too cautious.'
    )


def _row(results: List[Result]) -> List[str]:
    good = [result for result in results if not result.failure]
    durations = [result.duration_s for result in results]
    nees = [value for result in results for value in result.nees]
    estimated = [result.estimated_error for result in good]
    true = [result.true_error for result in good]
    return [
        f'{len(good)}/{len(results)}',
        f'{np.median(durations):.1f}',
        f'{max(durations):.1f}',
        _within(estimated),
        _within(true),
        *_rms(estimated),
        *_rms(true),
        f'{np.mean(nees):.2f}',
        f'{np.median(nees):.2f}',
        f'{sum(durations) / sum(result.wall_s for result in results):.0f}',
    ]


def _within(errors: List[Pose2D]) -> str:
    inside = sum(
        math.hypot(error.x_m, error.y_m) <= XY_TOLERANCE_M and abs(error.yaw_rad) <= YAW_TOLERANCE_RAD
        for error in errors
    )
    return f'{inside}/{len(errors)}'


def _rms(errors: List[Pose2D]) -> Tuple[str, str]:
    if not errors:
        return '-', '-'
    square_m2 = np.mean([error.x_m**2 + error.y_m**2 for error in errors])
    square_rad2 = np.mean([error.yaw_rad**2 for error in errors])
    return f'{1e3 * math.sqrt(square_m2):.1f}', f'{math.degrees(math.sqrt(square_rad2)):.2f}'


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tests', nargs='+', default=['SL', 'SMT', 'DLD'])
    parser.add_argument('--ppr', nargs='+', type=COUNT, default=[40, 90, 1024, 4096])
    parser.add_argument('--amcl', default='amcl', help="AMCL's parameters: a file of config/, without .yaml")
    parser.add_argument('--trials', type=COUNT, default=30)
    parser.add_argument('--first', type=COUNT, default=1, help='number of the first trial')
    parser.add_argument('--workers', type=COUNT, default=os.cpu_count())
    return parser.parse_args()


if __name__ == '__main__':
    main()
