#!/usr/bin/env python3
"""Whether /odom's covariance says what odometry is wrong by (NEES), by pulses per revolution.

Of rounding only: drives with sampled lengths, angles and speeds, each seen from other wheel phases, and with
--real-drives the drives of a wheelchair. With --campaign the paper's tests: a few navigated drives of each test, each
seen from many wheel phases, with slip drawn anew: of the robot of a campaign, and of robots whose geometry is drawn.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from bench import ALTO, ROOT, in_processes, parser, plan_of, print_header, print_table
from measured_drive import TICKS_PER_REPORT
from quantisation import End, end_of_drive

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.slip import WheelErrorParams
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from phase_drives import DRIVES, nees_of_phases, sampled_nees

ALLOWED = (0.8, 1.25)
PPRS = (20.0, 40.0, 90.0, 250.0, 1024.0)
WHEELCHAIR = {'wheel_diameter': 0.317, 'wheel_separation': 0.56, 'motion_noise': 0.0}
TICKS_PER_TURN, ENDS = 409_600, 20

LEGEND = """
NEES / 3: 1 is honest; above, odometry is surer than it may be. +-: two standard errors of the mean, over drives where
there are several. Alone: mean of error^2 over variance. On the way: at a report of the second half, drawn by seed.
Noise alone: the same, if the covariance is not told of radius errors. Robots: the difference of the diameters
is drawn for each seed, normal, with the campaign's as its standard deviation."""


class Case(NamedTuple):
    test: str
    ppr: float
    drive: int


class Ends(NamedTuple):
    goal: List[End]
    way: List[End]
    noise_alone: List[End]
    robots: List[End]


class DriveRecorder(Publications):
    """Keeps the wheels' angles since the start, in each tick, with the truth at that time."""

    def __init__(self) -> None:
        self.samples: List[Tuple[int, Sequence[float], Pose2D]] = []
        self._simulator: Simulator

    def begin(self, trial: object, simulator: Simulator, robot_file: object) -> None:
        self._simulator = simulator

    def joint_states(self, joints: JointStates) -> None:
        self.samples.append((joints.stamp_ns, joints.angles_rad, self._simulator.physics.base_pose_in_plane()))


def main() -> None:
    made = parser(__doc__, phases=1000, drives=6, seeds=25, workers=os.cpu_count())
    made.add_argument('--real-drives', type=Path, metavar='FOLDER', help='with wheelchair_1.txt and wheelchair_2.txt')
    made.add_argument('--steady', type=float, metavar='M/S', help='speed of all sampled drives, instead of varied ones')
    made.add_argument('--campaign', metavar='NAME', help="navigate the campaign's tests instead, such as of paper")
    made.add_argument('--tests', nargs='+', default=['SL', 'SMT', 'DLD'], help='of the campaign')
    made.add_argument('--ppr', nargs='+', type=float, default=[40.0, 90.0, 1024.0, 4096.0], help='of the campaign')
    arguments = made.parse_args()
    if arguments.campaign is None:
        _print_rounding(arguments.phases, arguments.real_drives, arguments.workers, arguments.steady)
        return
    print_header(f"NEES of odometry's covariance: {arguments.drives} drives with {arguments.seeds} seeds each")
    cells = list(itertools.product(arguments.tests, arguments.ppr))
    cases = [Case(*cell, drive) for cell in cells for drive in range(1, arguments.drives + 1)]
    work = functools.partial(_ends_of_drive, arguments.campaign, arguments.seeds)
    found = list(zip(cases, in_processes(work, cases, arguments.workers)))
    rows = [[cell[0], f'{cell[1]:g}', *_row([ends for case, ends in found if case[:2] == cell])] for cell in cells]
    names = ('goal', 'on the way', 'noise alone', 'robots')
    heads = ['test', 'PPR', *(f'NEES / 3\n{name}' for name in names), 'goal: x\nalone', 'y', 'yaw', 'inside']
    print_table(rows, heads, 2)
    print(LEGEND)


def _print_rounding(phases: int, folder: Optional[Path], workers: int, steady_mps: Optional[float]) -> None:
    print_header(f"NEES / 3 of odometry's covariance by rounding only, {phases} wheel phases")
    real = sorted(folder.glob('wheelchair_*.txt')) if folder else []
    cells = list(itertools.product([*DRIVES, *real], PPRS))
    found = dict(zip(cells, in_processes(functools.partial(_mean_nees, phases, steady_mps), cells, workers)))
    rows = [
        [getattr(drive, 'stem', drive), *(f'{found[drive, ppr]:.2f}' for ppr in PPRS)] for drive in [*DRIVES, *real]
    ]
    print_table(rows, ['drive', *(f'{ppr:g} counts' for ppr in PPRS)])


def _mean_nees(phases: int, steady_mps: Optional[float], cell: Tuple[Union[str, Path], float]) -> float:
    drive, ppr = cell
    if isinstance(drive, str):
        return float(np.mean([sampled_nees(DRIVES[drive], ppr, seed, steady_mps) for seed in range(phases)]))
    table = np.loadtxt(drive, skiprows=1)
    stamps_ms, rows = np.unique(table[:, 0], return_index=True)
    angles_rad = 2.0 * math.pi / TICKS_PER_TURN * (table[rows, -2:] - table[rows[0], -2:])
    ends = np.linspace(0, len(rows) - 1, ENDS + 1).astype(int)[1:]
    wheels = (stamps_ms * 1e6).astype(np.int64), angles_rad, OdometryParams(ppr=ppr, **WHEELCHAIR)
    starts_rad = (generator(seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2) for seed in range(phases))
    return float(np.mean([nees_of_phases(*wheels, start_rad, ends) for start_rad in starts_rad]))


def _ends_of_drive(campaign: str, seeds: int, case: Case) -> Ends:
    cell = load_campaign(campaign, ROOT, {'tests': [case.test], 'ppr': [case.ppr], 'trials': 1}).cells[0]
    params, errors = cell.robot_params, cell.robot_params.simulator.wheel_errors
    drive = _navigated(case, params)
    odometry = params.odometry.model_copy(update={'ppr': cell.encoder.ppr})
    exact = odometry.model_copy(update={'distance_std': 0.0, 'turn_std': 0.0, 'diameter_difference_std': 0.0})
    ends = Ends([], [], [], [])
    for number in range(seeds):
        seed = 10_000 * case.drive + number
        way = int(generator(seed, 'benchmark_end').integers(len(drive) // 2, len(drive)))
        at_end = functools.partial(end_of_drive, drive, case.ppr, seed)
        ends.goal.append(at_end(errors, odometry, len(drive) - 1))
        ends.way.append(at_end(errors, odometry, way))
        ends.noise_alone.append(at_end(errors, exact, len(drive) - 1))
        ends.robots.append(at_end(_drawn(errors, seed), odometry, len(drive) - 1))
    return ends


def _navigated(case: Case, params: RobotParams) -> Drive:
    """Drive the test with ideal wheels: where the robot goes hardly depends on its odometry."""
    ideal = params._replace(simulator=params.simulator.model_copy(update={'wheel_errors': WheelErrorParams()}))
    recorder = DriveRecorder()
    for _ in LockstepTrial(plan_of(case.test, case.ppr, case.drive), ALTO, ideal, recorder).run():
        pass
    stamps_ns, angles_rad, poses = map(np.array, zip(*recorder.samples[::TICKS_PER_REPORT]))
    return Drive(stamps_ns, angles_rad - angles_rad[0], poses)


def _drawn(errors: WheelErrorParams, seed: int) -> WheelErrorParams:
    """Return the wheels of another robot of the kind that odometry takes this one for."""
    spread = abs(errors.right_radius_error - errors.left_radius_error)
    half = 0.5 * spread * float(generator(seed, 'benchmark_robot').standard_normal())
    return errors.model_copy(update={'left_radius_error': -half, 'right_radius_error': half})


def _row(drives: Sequence[Ends]) -> Iterator[str]:
    for index in range(len(Ends._fields)):
        means = np.array([np.mean(_nees(drive[index])) for drive in drives])
        every = np.concatenate([_nees(drive[index]) for drive in drives])
        within = np.std(every, ddof=1) / math.sqrt(len(every))
        between = np.std(means, ddof=1) / math.sqrt(len(means)) if len(means) > 1 else 0.0
        yield f'{np.mean(every):.2f} +- {2.0 * max(within, between):.2f}'
    goal = [end for drive in drives for end in drive.goal]
    yield from (f'{value:.2f}' for value in np.mean([end.error**2 / np.diag(end.covariance) for end in goal], axis=0))
    yield 'yes' if ALLOWED[0] <= np.mean(_nees(goal)) <= ALLOWED[1] else 'NO'


def _nees(ends: Sequence[End]) -> np.ndarray:
    """(n,) NEES / 3."""
    return np.array([end.error @ np.linalg.solve(end.covariance, end.error) for end in ends]) / 3.0


if __name__ == '__main__':
    main()
