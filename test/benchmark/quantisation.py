#!/usr/bin/env python3
"""Odometry errors over many seeds against the closed forms of an encoder's rounding, odometry minus truth.

The simulator drives each test once; its wheel angles are then seen through encoder and odometry from the wheel phases
that the simulator draws for each seed. The straight drive is judged at its goal, the turn at a random moment of its
last round at full speed, since the closed form is the mean over angles that are no whole number of pulses. The heading
of the straight drive has a closed form of its own, for the travel that the wheels end with.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
from concurrent.futures import ProcessPoolExecutor
from typing import Dict, List, NamedTuple, Tuple

import numpy as np
from bench import minus, parser, print_header, print_table
from measured_drive import WHEEL_RADIUS_M, WHEEL_SEPARATION_M, compare, new_simulator, read_test, record_drive
from scipy import stats

from diff_encoder_sim.analysis.closed_form import heading_std_rad
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.robots.simulated_robot import TrueWheels
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.slip import SlippingWheels, WheelErrorParams
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

PPRS = (40, 90, 1024, 4096)

# Of a wheel, at the end of either drive: more than it takes to stop.
BRAKING_M = 0.2

Z_99 = stats.norm.ppf(0.995)
YES = {True: 'yes', False: 'NO'}


class End(NamedTuple):
    """Odometry against truth at one instant of one seed's drive."""

    error: np.ndarray  # (3,) x [m], y [m], yaw [rad] in the start's frame
    covariance: np.ndarray  # (3, 3) as the odometry states it


def main() -> None:
    arguments = parser(__doc__, seeds=200).parse_args()
    print_header(f'Odometry errors over {arguments.seeds} seeds against closed forms')
    drives = {}
    for name in ('SL', 'SMT'):
        test = read_test(name)
        simulator = new_simulator(test, PhysicsParams())
        drives[name] = record_drive(simulator, test)
        simulator.close()
    seeds = range(1, arguments.seeds + 1)
    with ProcessPoolExecutor(os.cpu_count()) as executor:
        cells = {}
        for name, ppr in itertools.product(drives, PPRS):
            run = functools.partial(_at_its_end, drives[name], ppr)
            cells[name, ppr] = list(executor.map(run, seeds, chunksize=10))
    _print_spread(cells, compare(drives['SL']).wheel_distance_m)


def end_of_drive(
    drive: Drive, ppr: float, seed: int, errors: WheelErrorParams, params: OdometryParams, end: int
) -> End:
    """Run ideal wheels' drive, turned by wheels with errors, through encoder and odometry, up to a row."""
    # The simulator's own draws: Simulator.reset.
    phases_rad = generator(seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2)
    geometry = TrueWheels(WHEEL_RADIUS_M, WHEEL_RADIUS_M, WHEEL_SEPARATION_M)
    wheels = SlippingWheels(errors, geometry, generator(seed, 'wheel_slip'), generator(seed, 'wheel_spin_and_bumps'))
    of_rolled = 1.0 / (1.0 + np.array([errors.left_radius_error, errors.right_radius_error]))
    turned_rad = np.array([wheels.turned(tuple(pair)) for pair in drive.wheel_angles_rad[: end + 1].tolist()])
    seen = Drive(drive.stamps_ns[: end + 1], phases_rad + of_rolled * turned_rad)
    estimate = Chain(EncoderParams(ppr=ppr), params).run(seen).estimates()[-1]
    start, truth = (Pose2D(*drive.true_poses[row].tolist()) for row in (0, end))
    return End(minus(estimate.base_pose_in_odom, truth.relative_to(start)), estimate.of_pose.matrix())


def _at_its_end(drive: Drive, ppr: float, seed: int) -> End:
    """The last of a straight drive; of a turn any at top speed in the last round before the robot brakes."""
    left_m, right_m = WHEEL_RADIUS_M * drive.wheel_angles_rad.T
    end, to_go_m = len(drive) - 1, right_m[-1] - right_m - BRAKING_M
    if left_m[-1] * right_m[-1] <= 0:
        candidates = np.flatnonzero((to_go_m > 0.0) & (to_go_m <= math.pi * WHEEL_SEPARATION_M))
        end = int(generator(seed, 'benchmark_end').choice(candidates))
    return end_of_drive(drive, ppr, seed, WheelErrorParams(), OdometryParams(ppr=ppr), end)


def _print_spread(cells: Dict[Tuple[str, float], List[End]], straight_wheel_travel_m: float) -> None:
    table: List[List[object]] = []
    for (name, ppr), ends in cells.items():
        errors = np.array([end.error for end in ends])
        d_over_l = math.pi * 2.0 * WHEEL_RADIUS_M / ppr / WHEEL_SEPARATION_M
        turn_deg = math.degrees(d_over_l * math.sqrt(1.0 / 3.0))
        heading_deg = np.degrees(errors[:, 2])
        if name == 'SL':
            lateral_m = 20.0 * d_over_l * math.sqrt(1.0 / 6.0)
            travel_m = np.array([straight_wheel_travel_m])
            exactly_deg = math.degrees(heading_std_rad(travel_m, d_over_l * WHEEL_SEPARATION_M, WHEEL_SEPARATION_M))
            table.append(_spread_row('straight 20 m: lateral [m]', ppr, errors[:, 1], lateral_m))
            table.append(_spread_row('straight 20 m: heading [deg]', ppr, heading_deg, exactly_deg))
        else:
            table.append(_spread_row('turn in place: heading [deg]', ppr, heading_deg, turn_deg))
    of_spread = ['standard\ndeviation', '99 % interval of it', 'closed\nform', 'inside']
    heads = ['PPR', *of_spread, 'mean', '99 %\n+-', '0 is\ninside']
    print_table(table, ['error', *heads])
    print('Intervals by chi-square: errors of rounding have shorter tails than normal ones, so they are a little wide.')


def _spread_row(label: str, ppr: float, values: np.ndarray, closed: float) -> List[object]:
    count, std, mean = len(values), float(np.std(values, ddof=1)), float(np.mean(values))
    low, high = (std * math.sqrt((count - 1) / stats.chi2.ppf(p, count - 1)) for p in (0.995, 0.005))
    half_width = Z_99 * std / math.sqrt(count)
    spread = f'{std:.5f}', f'{low:.5f} .. {high:.5f}', f'{closed:.5f}', YES[low <= closed <= high]
    return [label, ppr, *spread, f'{mean:+.5f}', f'{half_width:.5f}', YES[abs(mean) <= half_width]]


if __name__ == '__main__':
    main()
