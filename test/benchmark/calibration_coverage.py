#!/usr/bin/env python3
"""How often the intervals of calibrate contain the truth: random robots of test/support/calibration_drives.py.

Each robot is calibrated by one drive of 5 minutes, which then predicts the end of another of 2 minutes. Then, the
processor time of 10 minutes with their prediction, without start and bag, with a noisy and an exact reference.
"""

from __future__ import annotations

import math
import os
import sys
import time
from typing import NamedTuple

import numpy as np
from bench import ROOT, in_processes, parser, print_header, print_table

sys.path.append(str(ROOT / 'test' / 'support'))

from calibration_drives import TrueRobot, random_robot, referenced_drive
from diff_encoder_sim.calibration.estimation import calibrate
from diff_encoder_sim.calibration.prediction import cross_predictions, predict

NOISY = TrueRobot(reference_hz=20.0)
BY_MOTION = ('slip_by_acceleration', 'slip_by_lateral_acceleration')
EXACT = NOISY._replace(slip_m2_per_m=0.0, slip_rad2_per_rad=0.0, noise_m=1e-9, noise_rad=1e-9, counts=10**7)


class Hits(NamedTuple):
    """Which intervals of a robot contain the truth."""

    names: list
    values: list
    predictions: list  # along, across, yaw
    supported: list  # of the slips by motion, if they are estimated


def check(job: tuple) -> Hits:
    """Calibrate the robot of a seed."""
    seed, has_yaw, slip = job
    rng = np.random.default_rng(seed)
    robot = random_robot(rng)._replace(**dict.fromkeys(BY_MOTION, slip or 0.0))
    calibration = calibrate([referenced_drive(robot, rng, has_yaw=has_yaw)], has_slip_by_motion=slip is not None)
    truth = dict(zip(TrueRobot._fields, robot))
    truth['radius_ratio'] = robot.right_wheel_diameter_m / robot.left_wheel_diameter_m
    truth['radius_per_separation'] = 0.5 * robot.left_wheel_diameter_m / robot.wheel_separation_m
    names, hits = list(calibration.values), []
    for name in names:
        value, (low, high) = calibration.values[name]
        off = truth[name] - value
        if name.endswith('yaw_rad'):
            off = (off + math.pi) % (2.0 * math.pi) - math.pi
        hits.append(low <= value + off <= high)
    prediction = predict(calibration, referenced_drive(robot, rng, 120.0, has_yaw=has_yaw))
    supported = [name not in calibration.unsupported for name in calibration.support]
    return Hits(names, hits, prediction.is_inside.tolist(), supported)


def processor_s(robot: TrueRobot, duration_s: float, drives: int) -> float:
    """Return the time to calibrate by some drives, and to predict each."""
    referenced = [referenced_drive(robot, np.random.default_rng(seed), duration_s / drives) for seed in range(drives)]
    start_s = time.process_time()
    cross_predictions(referenced, None, calibrate(referenced).parameters)
    return time.process_time() - start_s


def main() -> None:
    """Print the coverage."""
    arguments = parser(__doc__, robots=1000, workers=os.cpu_count())
    arguments.add_argument('--first', type=int, default=0, metavar='SEED', help='of the first robot')
    arguments.add_argument('--positions', action='store_true', help='references without yaw')
    arguments.add_argument('--slip', type=float, metavar='K', help='of both slips by motion, which are estimated')
    options = arguments.parse_args()
    print_header(__doc__)
    jobs = [
        (seed, not options.positions, options.slip) for seed in range(options.first, options.first + options.robots)
    ]
    found = in_processes(check, jobs, options.workers)
    rows = [
        (name, 95, f'{100.0 * np.mean([hits.values[place] for hits in found]):.1f}')
        for place, name in enumerate(found[0].names)
    ]
    axes = ('along', 'across', 'yaw')[: 2 if options.positions else 3]
    inside = np.array([hits.predictions for hits in found])[:, : len(axes)]
    rows += [(f'prediction, {axis}', 90, f'{100.0 * of_axis.mean():.1f}') for axis, of_axis in zip(axes, inside.T)]
    rows.append(('prediction, all axes', 90, f'{100.0 * inside.mean():.1f}'))
    print_table(rows, ('interval of', 'level [%]', f'contains the truth [%], {len(found)} robots'))
    if options.slip is not None:
        supported = np.mean([hits.supported for hits in found], axis=0)
        print_table(
            [(name, f'{100.0 * each:.1f}') for name, each in zip(BY_MOTION, supported)], ('slip', 'supported [%]')
        )
        return
    processor_s(NOISY, 60.0, 1)  # loads the kernels
    cases = [(name, drives, robot) for name, robot in (('noisy', NOISY), ('exact', EXACT)) for drives in (1, 3)]
    times = [(name, drives, f'{processor_s(robot, 600.0, drives):.1f}') for name, drives, robot in cases]
    print_table(times, ('reference', 'drives in 10 min', 'processor [s]'))


if __name__ == '__main__':
    main()
