#!/usr/bin/env python3
"""What a closed-loop trial in lockstep costs: times real time, and how many times PyBullet's bare stepping of the
same duration, measured in turn with it. One process, one thread, processor time."""

from __future__ import annotations

import math
import os
import statistics
import tempfile
import time
import unittest.mock
from pathlib import Path
from typing import Dict
from xml.etree import ElementTree

from bench import ALTO, CONFIG, ROOT, Ratio, parser, plan_of, print_header, print_table, report_ratios

from diff_encoder_sim.base.imu import imu_settings
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.robots import simulated_robot
from diff_encoder_sim.robots.description import RobotSource, RobotTree
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import TICK_NS
from diff_encoder_sim.trials.robot_params import RobotParams, load_robot_config, override
from lockstep_trials import run_trial

BARE = 'bare stepping'
# The limits are in units of this stepping, with all links and solids.
LIMITS_PHYSICS = PhysicsParams(steps_per_tick=2, solver_iterations=50)
# Record modes, and how many times the bare stepping a trial of DLD may cost.
MODES = {'full': 1.6, 'minimal': 1.4, 'none': None}
# `fusion` of trials with an IMU, recorded in full, and how many times one without an IMU they may cost.
WITH_IMU, IMU_LIMIT = {'IMU at 100 Hz': 'none', 'fused with IMU': 'embedded'}, 1.1


def main() -> None:
    made = parser(__doc__, has_ratios=True, ppr=90, trial=1, repeats=5)
    made.add_argument('--test', default='DLD')
    arguments = made.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    print_header(f'{arguments.test} {arguments.ppr} PPR in lockstep, on one core, in {arguments.repeats} rounds')
    with tempfile.TemporaryDirectory() as folder:
        plan = plan_of(arguments.test, arguments.ppr, arguments.trial, bag=str(Path(folder) / 'trial.bag'))
        params = override(load_robot_config(CONFIG), {})
        duration_s = run_trial(plan, ALTO, params, 'full').duration_s  # compiles, fills caches
        rounds = [_round(plan, params, duration_s) for _ in range(arguments.repeats)]
        costs_s = {name: statistics.median(costs[name] for costs in rounds) for name in (*MODES, *WITH_IMU, BARE)}
        rows = [[name, f'{cost_s:.2f}', f'{duration_s / cost_s:.0f}'] for name, cost_s in costs_s.items()]
        print_table(rows, [f'{duration_s:.1f} s simulated', 'processor [s]', 'times real time'])
        ratios = [
            Ratio(f'{plan.trial.test.name}, record {mode}', BARE, [costs[mode] / costs[BARE] for costs in rounds], most)
            for mode, most in MODES.items()
        ]
        ratios += [
            Ratio(name, 'record full', [costs[name] / costs['full'] for costs in rounds], IMU_LIMIT)
            for name in WITH_IMU
        ]
        report_ratios(arguments, ratios)


def _round(plan: TrialPlan, params: RobotParams, duration_s: float) -> Dict[str, float]:
    """Return the processor time [s] of a trial by record mode, and that of bare stepping around them.

    A machine's speed wanders within minutes: bare stepping before, between and after sees what the trials see.
    """
    bare_s, costs_s = [bare_stepping_s(plan, params, duration_s)], {}
    with_imu = override(load_robot_config(CONFIG), imu_settings('mpu6050', CONFIG, ROOT))
    for name in (*MODES, *WITH_IMU):
        driven = plan.model_copy(update={'trial': plan.trial.model_copy(update={'fusion': WITH_IMU.get(name, 'none')})})
        begin_s = time.process_time()
        run_trial(driven, ALTO, with_imu if name in WITH_IMU else params, name if name in MODES else 'full')
        costs_s[name] = time.process_time() - begin_s
        bare_s.append(bare_stepping_s(plan, params, duration_s))
    return {**costs_s, BARE: statistics.mean(bare_s)}


def bare_stepping_s(plan: TrialPlan, params: RobotParams, duration_s: float) -> float:
    """Return the processor time of stepSimulation alone, on a straight drive of this duration."""

    def as_written(tree: RobotTree) -> str:
        return ElementTree.tostring(tree.xml, encoding='unicode')

    simulated = params.simulator.model_copy(update={'physics': LIMITS_PHYSICS})
    with unittest.mock.patch.object(simulated_robot, 'joined_links', as_written):
        simulator = Simulator(plan.world, RobotSource(ALTO), simulated, plan.trial.test.start.pose(), 0)
    try:
        simulator.command(0.0, 0.5)
        for _ in range(100):
            simulator.tick()
        simulator.physics._near.look(0.0, 0.0, math.inf)
        begin_s = time.process_time()
        for _ in range(round(duration_s * 1e9 / TICK_NS)):
            simulator.physics._bullet.stepSimulation()
        return time.process_time() - begin_s
    finally:
        simulator.close()


if __name__ == '__main__':
    main()
