#!/usr/bin/env python3
"""What a closed-loop trial in lockstep costs: times real time, the fraction of each part, and PyBullet's
bare stepping of the same duration, which is the limit. One process, one thread, processor time."""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

from checkout import ROOT, print_header
from measured_drive import bullet_client
from plans import plan_of
from tabulate import tabulate

from diff_encoder_sim.encoders.wheel_encoder import DiffEncoder
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.lockstep.bag_publications import BagPublications
from diff_encoder_sim.lockstep.lockstep_trial import LockstepTrial
from diff_encoder_sim.lockstep.robot_params import RobotParams, load_robot_params
from diff_encoder_sim.lockstep.trial_run import run_trial
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.odometry.wheel_odometry import WheelOdometry
from diff_encoder_sim.recording.trial_bag import TrialBag
from diff_encoder_sim.simulation.periods import TICK_NS
from diff_encoder_sim.simulation.physics import BulletPhysics
from diff_encoder_sim.simulation.quiet_pybullet import pybullet
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.trials.trial_definition import TrialPlan

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
# The parts, and the methods whose time counts as theirs; what is called within them is not counted twice.
PARTS: List[Tuple[str, type, Tuple[str, ...]]] = [
    ('physics (PyBullet)', BulletPhysics, ('tick',)),
    ('reading the simulated robot', BulletPhysics, ('wheels', 'base', 'base_pose', 'obstacle_hit')),
    ('LiDAR', Simulator, ('scan',)),
    ('encoder and odometry', DiffEncoder, ('update',)),
    ('encoder and odometry', WheelOdometry, ('update',)),
    ('AMCL', Amcl, ('update',)),
    ('navigation (costmaps, planner, DWA)', Navigator, ('take_scan', 'take_odometry', 'step', 'set_goal')),
    ('serialising and writing', BagPublications, ('_write',)),
    ('serialising and writing', TrialBag, ('__exit__',)),
    ('setting up', LockstepTrial, ('__init__',)),
]


class Stopwatch:
    """Time by part, while the parts' methods are replaced by ones that measure."""

    def __init__(self) -> None:
        self.spent_s: Dict[str, float] = {}
        self._stack: List[float] = []  # time spent in parts called by the part that runs

    def __enter__(self) -> Stopwatch:
        self._originals = [(kind, name, getattr(kind, name)) for _, kind, names in PARTS for name in names]
        for part, kind, names in PARTS:
            for name in names:
                setattr(kind, name, self._measured(part, getattr(kind, name)))
        return self

    def __exit__(self, *_: object) -> None:
        for kind, name, original in self._originals:
            setattr(kind, name, original)

    def _measured(self, part: str, method: Callable) -> Callable:
        def measured(*arguments: Any, **named: Any) -> Any:
            self._stack.append(0.0)
            begin_s = time.process_time()
            try:
                return method(*arguments, **named)
            finally:
                took_s = time.process_time() - begin_s
                self.spent_s[part] = self.spent_s.get(part, 0.0) + took_s - self._stack.pop()
                if self._stack:
                    self._stack[-1] += took_s

        return measured


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print_header(f'{arguments.test} {arguments.ppr} PPR in lockstep, on one core')
    with tempfile.TemporaryDirectory() as folder:
        plan = plan_of(arguments.test, arguments.ppr, arguments.trial, bag=str(Path(folder) / 'trial.bag'))
        params = load_robot_params(ROOT / 'config')
        run_trial(plan, ROBOT, params, 'full')  # compiles, fills caches
        rows, costs_s = [], {}
        for mode in ('full', 'minimal', 'none'):
            duration_s, costs_s[mode] = min(
                (_run(plan, params, mode) for _ in range(arguments.repeats)), key=lambda run: run[1]
            )
            size_mb = os.path.getsize(plan.bag) * 1e-6 if mode != 'none' else 0.0
            rows.append(
                [
                    f'record {mode}',
                    f'{duration_s:.1f}',
                    f'{costs_s[mode]:.2f}',
                    f'{duration_s / costs_s[mode]:.0f}',
                    f'{size_mb:.1f}',
                ]
            )
        bare_s = min(_bare_stepping_s(plan, params, duration_s) for _ in range(arguments.repeats))
        rows.append(['bare stepping', f'{duration_s:.1f}', f'{bare_s:.2f}', f'{duration_s / bare_s:.0f}', ''])
        print(
            tabulate(
                rows,
                ['', 'simulated [s]', 'processor [s]', 'times real time', 'bag [MB]'],
                disable_numparse=True,
                stralign='right',
            )
        )
        print(f'\nthe whole trial takes {costs_s["full"] / bare_s:.1f} times the bare stepping\n')
        with Stopwatch() as stopwatch:
            begin_s = time.process_time()
            run_trial(plan, ROBOT, params, 'full')
            whole_s = time.process_time() - begin_s
    fractions = {**stopwatch.spent_s, 'the rest': whole_s - sum(stopwatch.spent_s.values())}
    print(
        tabulate(
            [
                [part, f'{100.0 * spent_s / whole_s:.1f}', f'{1e3 * spent_s / duration_s:.2f}']
                for part, spent_s in sorted(fractions.items(), key=lambda item: -item[1])
            ],
            ['part (record full, measured)', 'fraction [%]', 'ms per simulated s'],
            disable_numparse=True,
            stralign='right',
        )
    )


def _run(plan: TrialPlan, params: RobotParams, mode: str) -> Tuple[float, float]:
    """(simulated, processor) time [s]."""
    begin_s = time.process_time()
    result = run_trial(plan, ROBOT, params, mode)
    return result.duration_s, time.process_time() - begin_s


def _bare_stepping_s(plan: TrialPlan, params: RobotParams, duration_s: float) -> float:
    """The robot drives straight and turns by turns; nothing but stepSimulation is measured."""
    simulator = Simulator(plan.world, ROBOT, params.simulator, plan.trial.test.start.pose(), 0)
    client, spent_s = bullet_client(simulator), 0.0
    try:
        simulator.command(0.0, 0.5)
        for _ in range(100):
            simulator.tick()
        begin_s = time.process_time()
        for _ in range(round(duration_s * 1e9 / TICK_NS)):
            pybullet.stepSimulation(physicsClientId=client)
        spent_s = time.process_time() - begin_s
    finally:
        simulator.close()
    return spent_s


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--test', default='DLD')
    parser.add_argument('--ppr', type=int, default=90)
    parser.add_argument('--trial', type=int, default=1)
    parser.add_argument('--repeats', type=int, default=3, help='of which the fastest counts')
    return parser.parse_args()


if __name__ == '__main__':
    main()
