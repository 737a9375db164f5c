#!/usr/bin/env python3
"""How straight the DWA drives SL with upstream's parameters, by how the motor controller measures speeds."""

from __future__ import annotations

import argparse
import math
import multiprocessing
from typing import Dict, List, NamedTuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from plans import plan_of
from tabulate import tabulate

from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import load_robot_config, override

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'

# What only this package's DWA has, off (config/navigation.yaml): the velocity of the robot is the twist as it is.
AS_UPSTREAM = {
    'navigation.DWAPlannerROS.twist_sigmas': 0.0,
    'navigation.DWAPlannerROS.latch_margin': 0.0,
    'navigation.DWAPlannerROS.stop': 'latch',
    'navigation.DWAPlannerROS.turn_to_path_angle': 0.0,
}
METHODS: Dict[str, Dict[str, object]] = {
    'M': {'config.velocity_method': 'M'},
    'M, low-pass 0.1 s': {'config.velocity_method': 'M', 'config.velocity_low_pass': 0.1},
    'M, low-pass 0.3 s': {'config.velocity_method': 'M', 'config.velocity_low_pass': 0.3},
    'T': {'config.velocity_method': 'T'},
    'MT': {'config.velocity_method': 'MT'},
}
HEADINGS = (
    'PPR',
    'method',
    'reached',
    'time [s]\nmedian',
    'most',
    'path [m]\nmean',
    'off the line\nrms [m]',
    'most [m]',
    'heading\nrms [deg]',
    'turning rate\nrms [deg/s]',
    'turns\nper metre',
)


class Cell(NamedTuple):
    """One trial: its encoder, how speeds are measured, and its number."""

    ppr: float
    method: str
    number: int


class Drive(NamedTuple):
    """What came of it, in truth."""

    failure: str  # '' when it reached its goal
    duration_s: float
    distance_m: float
    off_line_m: np.ndarray  # (n,) at each /odom, from the line to the goal
    yaws_rad: np.ndarray  # (n,)
    period_s: float  # between them


def main() -> None:
    """Run the trials and print the table."""
    arguments = _arguments()
    print_header(f'{arguments.trials} trials of SL for each method in lockstep, DWA as upstream')
    cells = [
        Cell(ppr, method, arguments.first + index)
        for ppr in arguments.ppr
        for method in METHODS
        for index in range(arguments.trials)
    ]
    with multiprocessing.Pool(arguments.workers) as pool:
        drives = dict(zip(cells, pool.imap(_run, cells)))
    for cell, drive in drives.items():
        if drive.failure:
            print(*cell, drive.failure)
    rows = [
        [f'{ppr:g}', method, *_row([drive for cell, drive in drives.items() if cell[:2] == (ppr, method)])]
        for ppr in arguments.ppr
        for method in METHODS
    ]
    print(tabulate(rows, HEADINGS, disable_numparse=True, stralign='right'))
    print('\nOff the line: distance of base_link from the line between start and goal, in truth.')
    print('Turns: changes of the sign of the turning rate, where it exceeds 1 degree/s both before and after.')


def _run(cell: Cell) -> Drive:
    params = override(load_robot_config(ROOT / 'config'), {**AS_UPSTREAM, **METHODS[cell.method]})
    trial = LockstepTrial(plan_of('SL', cell.ppr, cell.number), ROBOT, params)
    poses = [report.true_pose_in_map for report in trial.run()]
    return Drive(
        trial.ending.reason,
        trial.time_ns * 1e-9,
        trial.distance_m,
        np.array([pose.y_m for pose in poses]),
        np.array([pose.yaw_rad for pose in poses]),
        1.0 / params.encoder.rate,
    )


def _row(drives: List[Drive]) -> List[str]:
    off_line_m = np.concatenate([drive.off_line_m for drive in drives])
    yaws_rad = np.concatenate([drive.yaws_rad for drive in drives])
    rates = [np.diff(drive.yaws_rad) / drive.period_s for drive in drives]
    distance_m = sum(drive.distance_m for drive in drives)
    times_s = [drive.duration_s for drive in drives]
    return [
        f'{sum(not drive.failure for drive in drives)}/{len(drives)}',
        f'{np.median(times_s):.1f}',
        f'{max(times_s):.1f}',
        f'{distance_m / len(drives):.2f}',
        f'{_rms(off_line_m):.3f}',
        f'{np.abs(off_line_m).max():.3f}',
        f'{math.degrees(_rms(yaws_rad)):.2f}',
        f'{math.degrees(_rms(np.concatenate(rates))):.2f}',
        f'{sum(map(_turns, rates)) / distance_m:.2f}',
    ]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _turns(rates_radps: np.ndarray) -> int:
    """Return how often the robot turns the other way."""
    clear = rates_radps[np.abs(rates_radps) > math.radians(1.0)]
    return int(np.count_nonzero(np.diff(np.sign(clear))))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--ppr', nargs='+', type=float, default=[40.0])
    parser.add_argument('--trials', type=COUNT, default=30)
    parser.add_argument('--first', type=COUNT, default=1, help='number of the first trial')
    parser.add_argument('--workers', type=COUNT, default=1)
    return parser.parse_args()


if __name__ == '__main__':
    main()
