"""PyBullet's bare stepping, with which trials and campaigns are compared."""

from __future__ import annotations

import math
import time
import unittest.mock
from xml.etree import ElementTree

from bench import ALTO

from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.robots import simulated_robot
from diff_encoder_sim.robots.description import RobotTree
from diff_encoder_sim.simulation.bullet import pybullet
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import TICK_NS
from diff_encoder_sim.trials.robot_params import RobotParams

BARE = 'bare stepping'
# The limits are in units of this stepping, with all links and solids.
LIMITS_PHYSICS = PhysicsParams(steps_per_tick=2, solver_iterations=50)


def _as_written(tree: RobotTree) -> str:
    return ElementTree.tostring(tree.xml, encoding='unicode')


def bare_stepping_s(plan: TrialPlan, params: RobotParams, duration_s: float) -> float:
    """Return the processor time of stepSimulation alone, on a straight drive of this duration."""
    simulated = params.simulator.model_copy(update={'physics': LIMITS_PHYSICS})
    with unittest.mock.patch.object(simulated_robot, 'joined_links', _as_written):
        simulator = Simulator(plan.world, ALTO, simulated, plan.trial.test.start.pose(), 0)
    try:
        simulator.command(0.0, 0.5)
        for _ in range(100):
            simulator.tick()
        simulator._physics._near.look(0.0, 0.0, math.inf)
        begin_s = time.process_time()
        for _ in range(round(duration_s * 1e9 / TICK_NS)):
            pybullet.stepSimulation(physicsClientId=simulator._physics._client)
        return time.process_time() - begin_s
    finally:
        simulator.close()
