#!/usr/bin/env python3
"""Where the navigated tests end with `stop: latch` and `stop: precise`, by pose estimate and in truth, and how long the
trials take."""

from __future__ import annotations

import argparse
import math
import multiprocessing
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from plans import plan_of
from tabulate import tabulate

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import load_robot_config, override

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
XY_TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, math.radians(3.0)
STOPS = ('latch', 'precise')


class Cell(NamedTuple):
    """One trial: its test, encoder and stop."""

    test: str
    ppr: float
    stop: str
    number: int


class Ending(NamedTuple):
    """What came of it."""

    failure: str  # '' when it reached its goal
    duration_s: float
    estimated: Optional[Pose2D]  # /global_pose in the goal's frame
    true: Pose2D


def main() -> None:
    """Run the trials and print the table."""
    arguments = _arguments()
    print_header(f'{arguments.trials} trials of each test, PPR and stop in lockstep; set: {arguments.set}')
    cells = [
        Cell(test, ppr, stop, arguments.first + index)
        for test in arguments.tests
        for ppr in arguments.ppr
        for stop in STOPS
        for index in range(arguments.trials)
    ]
    with multiprocessing.Pool(arguments.workers, _use_settings, (arguments.set,)) as pool:
        endings = dict(zip(cells, pool.imap(_run, cells)))
    for cell, ending in endings.items():
        if ending.failure:
            print(*cell, ending.failure)
    rows = [
        [test, f'{ppr:g}', stop, *_row(endings, test, ppr, stop)]
        for test in arguments.tests
        for ppr in arguments.ppr
        for stop in STOPS
    ]
    print(tabulate(rows, HEADINGS, disable_numparse=True, stralign='right'))
    print(
        f'\nOf the pose estimate minus the goal, in its frame: mean and standard deviation, and the greatest distance. '
        f'Within {XY_TOLERANCE_M} m and {math.degrees(YAW_TOLERANCE_RAD):.0f} degrees of the goal. '
        'Time: median, and the most that a trial took longer than the same trial with latch.'
    )


HEADINGS = (
    'test',
    'PPR',
    'stop',
    'reached',
    'along\n[mm]',
    'across\n[mm]',
    'heading\n[deg]',
    'farthest\n[mm]',
    'within,\nestimated',
    'within,\ntrue',
    'true along\n[mm]',
    'true across\n[mm]',
    'true heading\n[deg]',
    'time\n[s]',
    'longer,\nmost [%]',
)

_settings: Dict[str, object] = {}


def _use_settings(given: Sequence[str]) -> None:
    for assignment in given:
        key, _, text = assignment.partition('=')
        _settings[key] = yaml_value(text, key)


def _run(cell: Cell) -> Ending:
    params = override(load_robot_config(ROOT / 'config'), {**_settings, 'navigation.DWAPlannerROS.stop': cell.stop})
    plan = plan_of(cell.test, cell.ppr, cell.number)
    loop = LockstepTrial(plan, ROBOT, params)
    for _ in loop.run():
        pass
    last, goal = loop.last_report, plan.trial.goal()
    assert last is not None
    estimated = last.estimated_pose_in_map
    return Ending(
        loop.ending.reason,
        last.stamp_ns * 1e-9,
        estimated and estimated.relative_to(goal),
        last.true_pose_in_map.relative_to(goal),
    )


def _row(endings: Dict[Cell, Ending], test: str, ppr: float, stop: str) -> List[str]:
    of_cell = {cell: ending for cell, ending in endings.items() if cell[:3] == (test, ppr, stop)}
    good = [ending for ending in of_cell.values() if not ending.failure and ending.estimated is not None]
    longer = [ending.duration_s / endings[cell._replace(stop='latch')].duration_s for cell, ending in of_cell.items()]
    estimated, true = _errors([ending.estimated for ending in good]), _errors([ending.true for ending in good])
    return [
        f'{len(good)}/{len(of_cell)}',
        *_spreads(estimated),
        f'{np.hypot(*estimated[:, :2].T).max(initial=0.0):.1f}',
        _within(estimated),
        _within(true),
        *_spreads(true),
        f'{np.median([ending.duration_s for ending in of_cell.values()]):.1f}',
        f'{100.0 * (max(longer) - 1.0):+.1f}',
    ]


def _errors(poses: Sequence[Optional[Pose2D]]) -> np.ndarray:
    """Return (n, 3) along, across [mm] and heading [degrees]."""
    return np.array([[1e3 * pose.x_m, 1e3 * pose.y_m, math.degrees(pose.yaw_rad)] for pose in poses if pose]).reshape(
        -1, 3
    )


def _spreads(errors: np.ndarray) -> Tuple[str, ...]:
    places = (1, 1, 2)
    return tuple(
        f'{mean:+.{digits}f} ± {spread:.{digits}f}'
        for mean, spread, digits in zip(errors.mean(axis=0), errors.std(axis=0, ddof=1), places)
    )


def _within(errors: np.ndarray) -> str:
    inside = (np.hypot(*errors[:, :2].T) <= 1e3 * XY_TOLERANCE_M) & (
        np.abs(errors[:, 2]) <= math.degrees(YAW_TOLERANCE_RAD)
    )
    return f'{inside.sum()}/{len(errors)}'


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tests', nargs='+', default=['SL'])
    parser.add_argument('--ppr', nargs='+', type=float, default=[40.0, 90.0, 1024.0, 4096.0])
    parser.add_argument('--trials', type=COUNT, default=30)
    parser.add_argument('--first', type=COUNT, default=1, help='number of the first trial')
    parser.add_argument('--set', nargs='+', default=['amcl.min_particles=3000'], metavar='KEY=VALUE')
    parser.add_argument('--workers', type=COUNT, default=1)
    return parser.parse_args()


if __name__ == '__main__':
    main()
