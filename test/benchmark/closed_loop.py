#!/usr/bin/env python3
"""The paper's tests navigated in lockstep, by pulses per revolution: where the pose estimate and the robot end, how
straight they drive, and the NEES of AMCL's covariance (divided by 3).

--compare stops: both stops of the DWA. --compare speeds: methods of measuring speed, with the DWA as upstream's.
"""

from __future__ import annotations

import math
import os
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from bench import ALTO, CONFIG, in_processes, minus, parser, plan_of, print_header, print_table, spreads

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial, Report
from diff_encoder_sim.trials.robot_params import load_robot_config, override

XY_TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, math.radians(3.0)
ESTIMATES_PER_TRIAL = 20  # neighbours on the path are alike
DWA = 'navigation.DWAPlannerROS'
# Without the features that only this package's DWA has.
AS_UPSTREAM = {f'{DWA}.{key}': 0.0 for key in ('twist_sigmas', 'latch_margin', 'turn_to_path_angle')}
AS_UPSTREAM[f'{DWA}.stop'] = 'latch'
SPEEDS = {
    'M': {'velocity_method': 'M'},
    'M, low-pass 0.1 s': {'velocity_method': 'M', 'velocity_low_pass': 0.1},
    'M, low-pass 0.3 s': {'velocity_method': 'M', 'velocity_low_pass': 0.3},
    'T': {'velocity_method': 'T'},
    'MT': {'velocity_method': 'MT'},
}
VARIANTS: Dict[str, Dict[str, Dict[str, object]]] = {
    'none': {'': {}},
    'stops': {stop: {f'{DWA}.stop': stop} for stop in ('latch', 'precise')},
    'speeds': {
        name: {**AS_UPSTREAM, **{f'config.{key}': value for key, value in given.items()}}
        for name, given in SPEEDS.items()
    },
}


class Job(NamedTuple):
    test: str
    ppr: float
    variant: str
    number: int
    settings: Dict[str, object]


class Drive(NamedTuple):
    failure: str  # '' if it reached its goal
    duration_s: float
    distance_m: float
    estimated: Optional[Pose2D]  # in the goal's frame
    true: Pose2D
    poses: np.ndarray  # (n, 3) in truth at each /odom; y of SL is the distance from its line
    period_s: float
    nees: List[float]  # of AMCL's estimates, divided by 3


def main() -> None:
    made = parser(__doc__, trials=30, first=1, workers=os.cpu_count())
    made.add_argument('--tests', nargs='+', default=['SL', 'SMT', 'DLD'])
    made.add_argument('--ppr', nargs='+', type=float, default=[40.0, 90.0, 1024.0, 4096.0])
    made.add_argument('--compare', choices=list(VARIANTS), default='none')
    made.add_argument('--set', nargs='+', default=[], metavar='KEY=VALUE', help='parameters, by dotted keys')
    options = made.parse_args()
    print_header(f'{options.trials} trials of each test and PPR in lockstep; set: {options.set}')
    given = {key: yaml_value(text, key) for key, _, text in (each.partition('=') for each in options.set)}
    jobs = [
        Job(test, ppr, variant, options.first + index, {**given, **settings})
        for test in options.tests
        for ppr in options.ppr
        for variant, settings in VARIANTS[options.compare].items()
        for index in range(options.trials)
    ]
    cells: Dict[Tuple[str, float, str], List[Drive]] = {}
    for job, drive in zip(jobs, in_processes(_run, jobs, options.workers)):
        cells.setdefault(job[:3], []).append(drive)
        if drive.failure:
            print(*job[:4], drive.failure)
    heads = ['reached', 'time [s]', 'most', 'along [mm]', 'across [mm]', 'yaw [deg]', 'farthest', 'estimated', 'true']
    print('Pose estimate minus goal; trials within 0.05 m and 3 degrees by estimate and in truth; AMCL:')
    print_table([[*cell, *_ends(found)] for cell, found in cells.items()], ['test', 'PPR', '', *heads, 'NEES'], 3)
    heads = ['along [mm]', 'across [mm]', 'yaw [deg]', 'path [m]', 'off line, rms', 'most [m]', 'yaw, rms [deg]']
    heads = ['test', 'PPR', '', *heads, 'rate, rms [deg/s]', 'turns per m']
    print('True pose minus goal; the drive in truth (off line and yaw: of SL). Turns: the turning rate changes sign.')
    print_table([[*cell, *_paths(found)] for cell, found in cells.items()], heads, 3)


def _run(job: Job) -> Drive:
    plan, params = plan_of(job.test, job.ppr, job.number), override(load_robot_config(CONFIG), job.settings)
    trial = LockstepTrial(plan, ALTO, params)
    reports, goal = list(trial.run()), plan.trial.goal()
    last = reports[-1]
    estimated = last.estimated_pose_in_map
    return Drive(
        trial.ending.reason,
        trial.time_ns * 1e-9,
        trial.distance_m,
        estimated and estimated.relative_to(goal),
        last.true_pose_in_map.relative_to(goal),
        np.array([report.true_pose_in_map for report in reports]),
        1.0 / params.encoder.rate,
        _nees(reports),
    )


def _nees(reports: List[Report]) -> List[float]:
    truth = {report.stamp_ns: report.true_pose_in_map for report in reports}
    estimates = {report.estimate.stamp_ns: report.estimate for report in reports if report.estimate is not None}
    values = []
    for estimate in list(estimates.values())[:: max(1, len(estimates) // ESTIMATES_PER_TRIAL)]:
        error = minus(estimate.base_pose_in_map, truth[estimate.stamp_ns])  # in the map's axes
        values.append(float(error @ np.linalg.solve(estimate.covariance, error)) / 3.0)
    return values


def _ends(drives: Sequence[Drive]) -> List[str]:
    good = [drive for drive in drives if not drive.failure and drive.estimated]
    estimated, times_s = np.array([drive.estimated for drive in good]).reshape(-1, 3), [d.duration_s for d in drives]
    return [
        f'{len(good)}/{len(drives)}',
        f'{np.median(times_s):.1f}',
        f'{max(times_s):.1f}',
        *spreads(estimated),
        f'{1e3 * np.hypot(*estimated[:, :2].T).max(initial=0.0):.1f}',
        _within(estimated),
        _within(np.array([drive.true for drive in good]).reshape(-1, 3)),
        f'{np.mean([value for drive in drives for value in drive.nees]):.2f}',
    ]


def _paths(drives: Sequence[Drive]) -> List[str]:
    _, off_line_m, yaws_rad = np.concatenate([drive.poses for drive in drives]).T
    rates = [np.diff(np.unwrap(drive.poses[:, 2])) / drive.period_s for drive in drives]
    distance_m = sum(drive.distance_m for drive in drives)
    clear = [rate[np.abs(rate) > math.radians(1.0)] for rate in rates]
    turns = sum(np.count_nonzero(np.diff(np.sign(rate))) for rate in clear)
    return [
        *spreads(np.array([drive.true for drive in drives if not drive.failure]).reshape(-1, 3)),
        f'{distance_m / len(drives):.2f}',
        f'{_rms(off_line_m):.3f}',
        f'{np.abs(off_line_m).max():.3f}',
        f'{math.degrees(_rms(yaws_rad)):.2f}',
        f'{math.degrees(_rms(np.concatenate(rates))):.2f}',
        f'{turns / distance_m:.2f}',
    ]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _within(errors: np.ndarray) -> str:
    inside = (np.hypot(*errors[:, :2].T) <= XY_TOLERANCE_M) & (np.abs(errors[:, 2]) <= YAW_TOLERANCE_RAD)
    return f'{inside.sum()}/{len(errors)}'


if __name__ == '__main__':
    main()
