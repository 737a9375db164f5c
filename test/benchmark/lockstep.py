#!/usr/bin/env python3
"""What a closed-loop trial in lockstep costs: times real time, the fraction of each part, and how many times PyBullet's
bare stepping of the same duration, measured in turn with it. One process, one thread, processor time."""

from __future__ import annotations

import os
import signal
import statistics
import tempfile
import time
from pathlib import Path
from types import FrameType
from typing import Dict, List, Optional, Sequence, Tuple

from bare_stepping import BARE, bare_stepping_s
from bench import ALTO, CONFIG, Ratio, parser, plan_of, print_header, print_table, report_ratios

from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.simulation.physics import BulletPhysics
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.navigating_driver import NavigatingDriver
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, load_robot_params
from diff_encoder_sim.trials.trial_run import run_trial

# Record modes, and how many times the bare stepping a trial of DLD may cost.
MODES = {'full': 1.6, 'minimal': 1.4, 'none': None}
# The parts, and the methods whose time counts as theirs, but for that of parts which they call.
PARTS: List[Tuple[str, type, Tuple[str, ...]]] = [
    ('physics (PyBullet)', BulletPhysics, ('tick',)),
    ('reading the simulated robot', BulletPhysics, ('wheels', 'base', 'base_pose', 'obstacle_hit')),
    ('LiDAR', Simulator, ('scan',)),
    ('encoder and odometry', LockstepTrial, ('_read',)),
    ('AMCL', Amcl, ('update',)),
    ('navigation (costmaps, planner, DWA)', Navigator, ('take_scan', 'take_odometry', 'step', 'set_goal')),
    ('serialising and writing', TrialBag, ('publish', '__exit__')),
    ('serialising and writing', Publications, ('joint_states', 'world_pose', 'odometry', 'global_pose')),
    ('driver of the route, pose estimate', NavigatingDriver, ('take_odometry', 'take_time')),
    ('wheel controller', Simulator, ('tick',)),
    ('truth, reports', LockstepTrial, ('run',)),
    ('setting up', LockstepTrial, ('__init__',)),
]
THE_REST = 'the rest'
SAMPLE_S = 0.001  # a kernel may sample less often


class Samples:
    """Counts which part runs, at ticks of the processor's time: nothing is slowed down, as by a stopwatch."""

    def __init__(self) -> None:
        self.counts: Dict[str, int] = {}
        self._parts = {getattr(kind, name).__code__: part for part, kind, names in PARTS for name in names}

    def __enter__(self) -> Samples:
        signal.signal(signal.SIGPROF, self._take)
        signal.setitimer(signal.ITIMER_PROF, SAMPLE_S, SAMPLE_S)
        return self

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0.0)

    def _take(self, number: int, frame: Optional[FrameType]) -> None:
        del number
        while frame is not None and frame.f_code not in self._parts:
            frame = frame.f_back
        part = THE_REST if frame is None else self._parts[frame.f_code]
        self.counts[part] = self.counts.get(part, 0) + 1


def main() -> None:
    """Print the tables."""
    made = parser(__doc__, has_ratios=True, ppr=90, trial=1, repeats=5)
    made.add_argument('--test', default='DLD')
    arguments = made.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print_header(f'{arguments.test} {arguments.ppr} PPR in lockstep, on one core, in {arguments.repeats} rounds')
    with tempfile.TemporaryDirectory() as folder:
        plan = plan_of(arguments.test, arguments.ppr, arguments.trial, bag=str(Path(folder) / 'trial.bag'))
        params = load_robot_params(CONFIG)
        duration_s = run_trial(plan, ALTO, params, 'full').duration_s  # compiles, fills caches
        rounds = [_round(plan, params, duration_s) for _ in range(arguments.repeats)]
        _print_costs(duration_s, rounds)
        ratios = [
            Ratio(f'{plan.trial.test.name}, record {mode}', BARE, [costs[mode] / costs[BARE] for costs in rounds], most)
            for mode, most in MODES.items()
        ]
        _print_parts(plan, params, duration_s, arguments.repeats)
        report_ratios(arguments, ratios)


def _round(plan: TrialPlan, params: RobotParams, duration_s: float) -> Dict[str, float]:
    """Return the processor time [s] of a trial by record mode, and that of bare stepping around them.

    A machine's speed wanders within minutes: bare stepping before, between and after sees what the trials see.
    """
    bare_s, costs_s = [bare_stepping_s(plan, params, duration_s)], {}
    for mode in MODES:
        begin_s = time.process_time()
        run_trial(plan, ALTO, params, mode)
        costs_s[mode] = time.process_time() - begin_s
        bare_s.append(bare_stepping_s(plan, params, duration_s))
    return {**costs_s, BARE: statistics.mean(bare_s)}


def _print_costs(duration_s: float, rounds: Sequence[Dict[str, float]]) -> None:
    rows = []
    for name in (*MODES, BARE):
        cost_s = statistics.median(costs[name] for costs in rounds)
        rows.append([name, f'{cost_s:.2f}', f'{duration_s / cost_s:.0f}'])
    heads = [f'{duration_s:.1f} s simulated', 'processor [s]', 'times real time']
    print_table(rows, heads)


def _print_parts(plan: TrialPlan, params: RobotParams, duration_s: float, repeats: int) -> None:
    begin_s = time.process_time()
    with Samples() as samples:
        for _ in range(repeats):
            run_trial(plan, ALTO, params, 'full')
    whole_s, count = (time.process_time() - begin_s) / repeats, sum(samples.counts.values())
    rows = [
        [part, f'{100.0 * part_count / count:.1f}', f'{1e3 * whole_s * part_count / count / duration_s:.2f}']
        for part, part_count in sorted(samples.counts.items(), key=lambda item: -item[1])
    ]
    heads = [f'part (record full, {count} samples)', 'fraction [%]', 'ms per simulated s']
    print_table(rows, heads)


if __name__ == '__main__':
    main()
