"""Simulators of ALTO in the shipped worlds."""

from pathlib import Path

import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'


@pytest.fixture
def make_simulator():
    made = []

    def make(
        world='hallway', start=Pose2D(-10, 0, 0), seed=1, robot=ROOT / 'urdf' / 'alto.urdf.xacro', floor=(), **params
    ):
        simulator = Simulator(
            world if isinstance(world, Path) else ROOT / 'worlds' / f'{world}.world',
            RobotSource(robot),
            SimulatorParams.from_mapping(params, 'test'),
            start,
            seed,
            floor,
        )
        made.append(simulator)
        return simulator

    yield make
    for simulator in made:
        simulator.close()
