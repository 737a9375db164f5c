#!/usr/bin/env python3
"""How contact shape, step and solver iterations change the simulated robot: the study behind
docs/adr/0001-contact-and-step.md.

The robot drives 20 m straight at 0.45 m/s and turns five times in place at 1 rad/s. Wheels that
roll without slipping must turn as far as the robot moves: the two columns of difference must
stay below 0.1 %. Nothing is asserted; the table is for reading.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Dict, List
from xml.etree import ElementTree

import measured_drive
from bench import ALTO, COUNT, parser, print_header, print_table

from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import GeometryErrors, SimulatedRobot, joined_links, load_simulated_robot
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.simulation import simulator as simulator_module
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.state import TICK_S

CYLINDER_WIDTH_M = 0.04
STEP_RATES_HZ = (200, 500, 1000)  # each divides 10 ms
ITERATIONS = (10, 20, 50, 100)

HEADERS = [
    'wheel\ncontact',
    'step\n[Hz]',
    'iter-\nations',
    'distance\ndiff. [%]',
    'angle\ndiff. [%]',
    '20 m: true\nyaw [deg]',
    'wheel yaw\n[deg]',
    'lateral\n[mm]',
    'us per step\nstraight / turn',
]


def main() -> None:
    made = parser(__doc__)
    made.add_argument('--contacts', nargs='+', choices=('sphere', 'cylinder'), default=['sphere', 'cylinder'])
    made.add_argument('--rates', nargs='+', type=COUNT, default=STEP_RATES_HZ, help='physics steps per second')
    made.add_argument('--iterations', nargs='+', type=COUNT, default=ITERATIONS, help='of the contact solver')
    arguments = made.parse_args()
    simulator_module.load_simulated_robot = _as_it_is
    print_header('Convergence of the physics: 20 m straight at 0.45 m/s, five turns at 1 rad/s')
    with tempfile.TemporaryDirectory() as folder:
        robots = {'sphere': ALTO, 'cylinder': _cylinder_robot(Path(folder))}
        rows = [
            _measure(contact, robots, rate_hz, iterations)
            for contact in arguments.contacts
            for rate_hz in arguments.rates
            for iterations in arguments.iterations
        ]
    print_table(rows, HEADERS)
    print(
        '\ndiff.: |truth - wheel angles| over the distance and over the angle. us per step: bare stepSimulation on '
        f'this robot\nin this world, processor time, the best of {measured_drive.WINDOWS} windows of 0.5 s.'
    )


def _measure(contact: str, robots: Dict[str, Path], rate_hz: int, iterations: int) -> List[str]:
    steps = round(rate_hz * TICK_S)
    physics = PhysicsParams(steps_per_tick=steps, solver_iterations=iterations)
    results, costs_us = [], []
    for name in ('SL', 'SMT'):
        test = measured_drive.read_test(name)
        simulator = measured_drive.new_simulator(test, physics, robots[contact])
        results.append(measured_drive.compare(measured_drive.record_drive(simulator, test)))
        costs_us.append(measured_drive.cruise_cost_us(simulator, test))
        simulator.close()
    straight, turn = results
    bare_us, turn_bare_us = costs_us
    distance = abs(straight.true_distance_m - straight.wheel_distance_m) / straight.true_distance_m
    angle = abs(turn.true_turn_rad - turn.wheel_turn_rad) / turn.true_turn_rad
    return [
        contact,
        str(rate_hz),
        str(iterations),
        f'{100 * distance:.4f}',
        f'{100 * angle:.4f}',
        f'{math.degrees(straight.true_turn_rad):+.4f}',
        f'{math.degrees(straight.wheel_turn_rad):+.4f}',
        f'{1000 * straight.lateral_m:+.2f}',
        f'{bare_us / steps:.1f} / {turn_bare_us / steps:.1f}',
    ]


def _as_it_is(source: RobotSource, choices: RobotChoices, errors: GeometryErrors) -> SimulatedRobot:
    """Load a robot as sound ones are, without replacing cylinder wheels by balls."""
    urdf = joined_links(parse_urdf(expansion(source).urdf, str(source.file)))
    return load_simulated_robot(source, choices, errors)._replace(urdf=urdf, floor_only_links=())


def _cylinder_robot(folder: Path) -> Path:
    """Return the shipped robot with wheels that touch the floor along a line."""
    root = ElementTree.fromstring(expansion(RobotSource(ALTO)).urdf)
    for side in ('left', 'right'):
        collision = root.find(f"link[@name='{side}_wheel']/collision")
        collision.find('origin').set('rpy', f'{math.pi / 2} 0 0')  # URDF cylinders stand upright
        geometry = collision.find('geometry')
        geometry.clear()
        size = {'radius': str(measured_drive.WHEEL_RADIUS_M), 'length': str(CYLINDER_WIDTH_M)}
        ElementTree.SubElement(geometry, 'cylinder', size)
    path = folder / 'cylinder_wheels.urdf'
    path.write_text(ElementTree.tostring(root, encoding='unicode'), encoding='utf-8')
    return path


if __name__ == '__main__':
    main()
