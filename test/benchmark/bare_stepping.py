"""PyBullet's bare stepping: the limit that trials and the live graph are compared with."""

from __future__ import annotations

import math
import time
import unittest.mock
from typing import ContextManager
from xml.etree import ElementTree

from checkout import ROOT
from measured_drive import bullet_client

from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.robots import simulated_robot
from diff_encoder_sim.robots.description import RobotTree
from diff_encoder_sim.simulation.bullet import pybullet
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import TICK_NS
from diff_encoder_sim.trials.robot_params import RobotParams

BARE = 'bare stepping'
ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
# The bare stepping that limits speak of.
LIMITS_PHYSICS = PhysicsParams(steps_per_tick=2, solver_iterations=50)


def links_as_written() -> ContextManager[object]:
    """Have simulators, within the context, load each link of a robot's file: that is what the limits speak of, too."""
    return unittest.mock.patch.object(simulated_robot, 'joined_links', _as_written)


def _as_written(tree: RobotTree) -> str:
    return ElementTree.tostring(tree.xml, encoding='unicode')


def bare_stepping_s(plan: TrialPlan, params: RobotParams, duration_s: float) -> float:
    """Return the processor time of stepSimulation alone, over as long a drive straight ahead.

    With the settings of which the limits speak, and all links and solids, whatever those of the robot are.
    """
    simulated = params.simulator.model_copy(update={'physics': LIMITS_PHYSICS})
    with links_as_written():
        simulator = Simulator(plan.world, ROBOT, simulated, plan.trial.test.start.pose(), 0)
    client, spent_s = bullet_client(simulator), 0.0
    try:
        simulator.command(0.0, 0.5)
        for _ in range(100):
            simulator.tick()
        simulator._physics._near.look(0.0, 0.0, math.inf)
        begin_s = time.process_time()
        for _ in range(round(duration_s * 1e9 / TICK_NS)):
            pybullet.stepSimulation(physicsClientId=client)
        spent_s = time.process_time() - begin_s
    finally:
        simulator.close()
    return spent_s
