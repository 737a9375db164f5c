#!/usr/bin/env python3
"""How well robots of all kinds roll: truth against their wheels, and what 4096 PPR make of SL and SMT.

Robots that come with the package, and descriptions as people write them (test/support/generated_robots.py). Each drives
on a flat floor within its own limits. The table of docs/adr/0017-robots.md; nothing is asserted.
"""

from __future__ import annotations

import logging
import math
import sys
import tempfile
from pathlib import Path
from typing import Iterator, List, Tuple

import numpy as np
from bench import CONFIG, ROOT, minus, parser, print_header, print_table

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot, load_simulated_robot
from diff_encoder_sim.simulation.self_check import FlatFloor
from diff_encoder_sim.simulation.simulator import DriveController, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S
from diff_encoder_sim.trials.robot_params import RobotConfig, load_robot, load_robot_config, override
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from generated_robots import RECIPES, urdf_of

SPEEDS_MPS = (0.1, 0.3, 1.0)
PPR = 4096
SL_M, SL_MPS = 20.0, 0.45
SMT_RAD, SMT_RADPS = 10 * math.pi, 1.0
TICKS_PER_REPORT = 5  # 20 Hz

HEADERS = [
    'robot',
    'mass\n[kg]',
    'on wheels\n[%]',
    'straight:\ndistance [%]',
    'yaw\n[deg/m]',
    'turns:\nangle [%]',
    'SL: lateral sd,\nclosed form [mm]',
    'bias\n[mm]',
    'SMT: yaw error\n[deg]',
    'one pulse\n[deg]',
]


def main() -> None:
    made = parser(__doc__, phases=100)
    made.add_argument('--robots', nargs='+', default=[], metavar='NAME', help='only these (default: all)')
    arguments = made.parse_args()
    print_header(f'Robots of all kinds: truth against wheels at {", ".join(map(str, SPEEDS_MPS))} m/s, or the limit')
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        for name, robot, params in _robots(Path(folder)):
            if not arguments.robots or name in arguments.robots:
                print(f'{name} ...', file=sys.stderr)
                rows.append(_row(name, robot, params, arguments.phases))
    print_table(rows, HEADERS)
    print(
        f'\nstraight, turns: worst difference over speeds, both ways. SL: 20 m at {SL_MPS} m/s (or the limit),\n'
        f'{PPR} PPR, {arguments.phases} phases of the encoders: odometry minus truth, across. SMT: five turns at '
        f'{SMT_RADPS:g} rad/s, largest yaw error; one pulse: d/L.'
    )


def _robots(folder: Path) -> Iterator[Tuple[str, SimulatedRobot, SimulatorParams]]:
    config = load_robot_config(CONFIG)
    for path in sorted((CONFIG / 'robots').glob('*.yaml')):
        yield (path.stem, *_loaded(str(path), config))
    for index, (name, recipe) in enumerate(RECIPES.items()):
        path = folder / f'robot_{index}.urdf'
        path.write_text(urdf_of(recipe, folder), encoding='utf-8')
        yield (name, *_loaded(str(path), config))


def _loaded(given: str, config: RobotConfig) -> Tuple[SimulatedRobot, SimulatorParams]:
    setup = load_robot(given, Path(), ROOT, {})
    params = override(config, setup.settings).simulator
    return load_simulated_robot(setup.file.source, params.choices()), params


def _row(name: str, robot: SimulatedRobot, params: SimulatorParams, phases: int) -> List[str]:
    floor = FlatFloor(robot, params.drive, params.physics)
    loads = floor.rest()
    straight = [floor.straight(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)]
    turns = [floor.turn(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)]
    floor.close()
    distance = max(abs(drive.true_distance_m / drive.wheel_distance_m - 1.0) for drive in straight)
    yaw_radpm = max(abs((drive.true_turn_rad - drive.wheel_turn_rad) / drive.wheel_distance_m) for drive in straight)
    angle = max(abs(drive.true_turn_rad / drive.wheel_turn_rad - 1.0) for drive in turns)
    description = robot.description
    pulse_rad = math.pi * description.wheel_diameter_m / PPR / description.wheel_separation_m
    speed_mps = min(SL_MPS, params.drive.max_linear_speed)
    rate_radps = min(SMT_RADPS, params.drive.max_angular_speed)
    line = _errors(robot, *_motion(robot, params, speed_mps, 0.0, SL_M / speed_mps), phases)
    spin = _errors(robot, *_motion(robot, params, 0.0, rate_radps, SMT_RAD / rate_radps), phases)
    return [
        name,
        f'{description.mass.mass_kg:.3g}',
        f'{100 * sum(loads.get(joint, 0.0) for joint in robot.joints):.0f}',
        f'{100 * distance:.4f}',
        f'{math.degrees(yaw_radpm):.4f}',
        f'{100 * angle:.4f}',
        f'{1000 * np.std(line[:, 1]):.2f}, {1000 * SL_M * pulse_rad * math.sqrt(1 / 6):.2f}',
        f'{1000 * np.mean(line[:, 1]):+.2f}',
        f'{math.degrees(np.abs(spin[:, 2]).max()):.4f}',
        f'{math.degrees(pulse_rad):.4f}',
    ]


def _motion(
    robot: SimulatedRobot, params: SimulatorParams, linear_mps: float, angular_radps: float, duration_s: float
) -> Tuple[np.ndarray, Pose2D]:
    """Drive at a velocity, then stop: the wheels' angles by tick, and the axle's middle at the end, in the start's."""
    floor = FlatFloor(robot, params.drive, params.physics)
    wheels = robot.description.radii_m, robot.description.wheel_separation_m
    controller = DriveController(params.drive, *wheels)
    floor.rest()
    begin, angles_rad = _axle_pose(floor, robot), [floor.physics.wheels().angles_rad]
    ticks = round(duration_s / TICK_S)
    for tick in range(ticks + round(3.0 / TICK_S)):
        command = (linear_mps, angular_radps) if tick < ticks else (0.0, 0.0)
        controller.command(tick * TICK_NS, *command)
        floor.physics.tick(*controller.wheel_speeds_radps(tick * TICK_NS, TICK_S))
        angles_rad.append(floor.physics.wheels().angles_rad)
    end = _axle_pose(floor, robot).relative_to(begin)
    floor.close()
    return np.array(angles_rad), end


def _axle_pose(floor: FlatFloor, robot: SimulatedRobot) -> Pose2D:
    return floor.physics.base_pose_in_plane().compose(Pose2D(robot.description.axle_x_m, 0.0, 0.0))


def _errors(robot: SimulatedRobot, angles_rad: np.ndarray, end: Pose2D, phases: int) -> np.ndarray:
    """Odometry minus truth at the end, (phases, 3): along, across, yaw."""
    description = robot.description
    wheels = {'wheel_diameter': description.wheel_diameter_m, 'wheel_separation': description.wheel_separation_m}
    chain = Chain(EncoderParams(ppr=PPR), OdometryParams(ppr=PPR, **wheels), phases)
    drive = Drive(np.arange(len(angles_rad))[::TICKS_PER_REPORT] * TICK_NS, angles_rad[::TICKS_PER_REPORT])
    run = chain.run(drive, np.random.default_rng(0).uniform(0.0, 2.0 * math.pi, (phases, 2)))
    return minus(run.final_poses, end)


if __name__ == '__main__':
    logging.disable(logging.WARNING)
    main()
