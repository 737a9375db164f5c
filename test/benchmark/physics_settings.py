#!/usr/bin/env python3
"""Which of PyBullet's settings make the simulated robot more accurate, or faster at equal accuracy.

Each row changes one thing against what simulation/physics.py does, by changing its calls to
PyBullet on their way, and repeats the drives of physics_convergence.py.
"""

from __future__ import annotations

import argparse
import math
import unittest.mock
from concurrent.futures import ProcessPoolExecutor
from types import MappingProxyType
from typing import Any, Callable, Dict, List, Mapping, NamedTuple

import numpy as np
import pybullet
from checkout import print_header
from counts import COUNT
from measured_drive import WINDOWS, bullet_client, compare, cruise_costs_us, new_simulator, read_test, record_drive
from tabulate import tabulate

from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import TICK_S

HEADERS = [
    'setting',
    'centre of mass\nx, z [m]',
    'distance\ndiff. [%]',
    'angle\ndiff. [%]',
    '20 m: true\nyaw [deg]',
    'wheel yaw\n[deg]',
    'lateral\n[mm]',
    '5 turns: end\noff [mm]',
    'us per tick\nstraight / turn',
]

Hook = Callable[[Simulator, PhysicsParams], None]


def _nothing(simulator: Simulator, physics: PhysicsParams) -> None:
    del simulator, physics


class Setting(NamedTuple):
    """One change against physics.py."""

    engine: Mapping[str, Any] = MappingProxyType({})  # more arguments of setPhysicsEngineParameter
    flags: int = 0  # more of loadURDF's
    when_loaded: Hook = _nothing


def main() -> None:
    """Print one row for each setting."""
    arguments = _arguments()
    print_header(f"PyBullet's settings, {arguments.steps} steps in each 10 ms, {arguments.iterations} iterations")
    physics = PhysicsParams(steps_per_tick=arguments.steps, solver_iterations=arguments.iterations)
    rows = [_in_own_process(name, physics) for name in arguments.settings]
    print(tabulate(rows, HEADERS, disable_numparse=True, stralign='right'))
    print(f'\nTimes are processor time of Simulator.tick, 10 ms, the best of {WINDOWS} windows of 0.5 s.')


def _in_own_process(name: str, physics: PhysicsParams) -> List[str]:
    # Some settings are global to PyBullet and outlive the world that they were made in.
    with ProcessPoolExecutor(max_workers=1) as executor:
        return executor.submit(_measure, name, physics).result()


def _measure(name: str, physics: PhysicsParams) -> List[str]:
    results, costs_us, offs_m = [], [], []
    with _calls_changed(SETTINGS[name], physics):
        for test_name in ('SL', 'SMT'):
            test = read_test(test_name)
            simulator = new_simulator(test, physics)
            SETTINGS[name].when_loaded(simulator, physics)
            rows = record_drive(simulator, test)
            results.append(compare(rows))
            end = rows[-1].true_pose.relative_to(rows[0].true_pose)
            offs_m.append(math.hypot(end.x_m, end.y_m))
            centre_m = _centre_of_mass_m(simulator)
            costs_us.append(cruise_costs_us(simulator, test)[0])
            simulator.close()
    straight, turn = results
    distance = abs(straight.true_distance_m - straight.wheel_distance_m) / straight.true_distance_m
    angle = abs(turn.true_turn_rad - turn.wheel_turn_rad) / turn.true_turn_rad
    return [
        name,
        f'{centre_m[0]:.4f}, {centre_m[2]:.4f}',
        f'{100 * distance:.5f}',
        f'{100 * angle:.5f}',
        f'{math.degrees(straight.true_turn_rad):+.4f}',
        f'{math.degrees(straight.wheel_turn_rad):+.4f}',
        f'{1000 * straight.lateral_m:+.3f}',
        f'{1000 * offs_m[1]:.3f}',
        f'{costs_us[0]:.1f} / {costs_us[1]:.1f}',
    ]


def _calls_changed(setting: Setting, physics: PhysicsParams) -> Any:
    """Give PyBullet's functions the setting's arguments within a context."""
    load, configure, step = (pybullet.loadURDF, pybullet.setPhysicsEngineParameter, pybullet.stepSimulation)

    def load_changed(file: str, flags: int = 0, **others: Any) -> int:
        return int(load(file, flags=flags | setting.flags, **others))

    def configure_changed(**arguments: Any) -> None:
        configure(**{**arguments, **_engine_arguments(setting, physics)})

    def step_changed(**client: int) -> None:
        for _ in range(physics.steps_per_tick if 'numSubSteps' in setting.engine else 1):
            step(**client)

    return unittest.mock.patch.multiple(
        pybullet, loadURDF=load_changed, setPhysicsEngineParameter=configure_changed, stepSimulation=step_changed
    )


def _engine_arguments(setting: Setting, physics: PhysicsParams) -> Dict[str, Any]:
    if 'numSubSteps' in setting.engine:
        return {**setting.engine, 'fixedTimeStep': TICK_S / physics.steps_per_tick}
    return setting.engine


def _centre_of_mass_m(simulator: Simulator) -> np.ndarray:
    """Return the centre of mass of the whole robot in base_link's frame, but for a lean of a third of a degree."""
    client, robot = bullet_client(simulator), simulator._physics._robot
    base = simulator.base_pose_in_world()
    moment, mass_kg = np.zeros(3), 0.0
    for link in range(-1, pybullet.getNumJoints(robot, physicsClientId=client)):
        link_kg = pybullet.getDynamicsInfo(robot, link, physicsClientId=client)[0]
        position = (
            pybullet.getBasePositionAndOrientation(robot, physicsClientId=client)[0]
            if link < 0
            else pybullet.getLinkState(robot, link, physicsClientId=client)[0]
        )
        moment += link_kg * np.array(position)
        mass_kg += link_kg
    x_m, y_m, z_m = (moment / mass_kg).tolist()
    cos_yaw, sin_yaw = math.cos(base.yaw_rad), math.sin(base.yaw_rad)
    from_base_m = x_m - base.x_m, y_m - base.y_m
    return np.array(
        [cos_yaw * from_base_m[0] + sin_yaw * from_base_m[1], cos_yaw * from_base_m[1] - sin_yaw * from_base_m[0], z_m]
    )


def _undamp(simulator: Simulator, _: PhysicsParams) -> None:
    client, robot = bullet_client(simulator), simulator._physics._robot
    for link in range(-1, pybullet.getNumJoints(robot, physicsClientId=client)):
        pybullet.changeDynamics(robot, link, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client)


def _lift_chassis_off_floor(simulator: Simulator, _: PhysicsParams) -> None:
    """Disable the collision between the body's box and the floor; the casters keep theirs."""
    client, physics = bullet_client(simulator), simulator._physics
    chassis = [
        link
        for link in range(-1, pybullet.getNumJoints(physics._robot, physicsClientId=client))
        if any(
            shape[2] == pybullet.GEOM_BOX
            for shape in pybullet.getCollisionShapeData(physics._robot, link, physicsClientId=client)
        )
    ]
    for floor in physics._floors:
        physics._filter(floor, chassis)


SETTINGS: Dict[str, Setting] = {
    'as shipped': Setting(),
    'fixed links merged by PyBullet': Setting(flags=pybullet.URDF_MERGE_FIXED_LINKS),
    'solver residual 1e-5': Setting({'solverResidualThreshold': 1e-5}),
    'solver residual 1e-7 (default)': Setting({'solverResidualThreshold': 1e-7}),
    'solver residual 0': Setting({'solverResidualThreshold': 0.0}),
    'contactERP 0.8': Setting({'contactERP': 0.8}),
    'frictionERP 0.8': Setting({'frictionERP': 0.8}),
    'friction cone': Setting({'enableConeFriction': 1}),
    'contact breaking at 2 mm': Setting({'contactBreakingThreshold': 0.002}),
    'direct solver (Dantzig)': Setting({'constraintSolverType': pybullet.CONSTRAINT_SOLVER_LCP_DANTZIG}),
    'order of pairs left open': Setting({'deterministicOverlappingPairs': 0}),
    'no damping': Setting(when_loaded=_undamp),
    'steps one by one': Setting({'numSubSteps': 0}),
    'chassis passes the floor': Setting(when_loaded=_lift_chassis_off_floor),
}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/physics_settings.py --settings '
        "'as shipped' 'solver residual 0'",
    )
    parser.add_argument(
        '--settings', nargs='+', choices=tuple(SETTINGS), default=list(SETTINGS), metavar='NAME', help='default: all'
    )
    parser.add_argument('--steps', type=COUNT, default=PhysicsParams().steps_per_tick, help='in each 10 ms')
    parser.add_argument(
        '--iterations', type=COUNT, default=PhysicsParams().solver_iterations, help='of the contact solver'
    )
    return parser.parse_args()


if __name__ == '__main__':
    main()
