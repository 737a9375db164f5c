"""Drives the simulated robot through a test and compares truth with wheel angles."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bench import ALTO, CONFIG, ROOT, minus

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_S
from diff_encoder_sim.trials.scripted_drive import SETTLING_S, ScriptedDrive

WHEEL_RADIUS_M, WHEEL_SEPARATION_M = 0.1, 0.4
REPORTS_PER_SECOND = 20
TICKS_PER_REPORT = round(1.0 / (REPORTS_PER_SECOND * TICK_S))
WINDOW_TICKS, WINDOWS = 50, 25  # half a second of simulated time, of which some have the caches to themselves


class Comparison(NamedTuple):
    """Truth beside what the wheels' angles say, over a whole drive."""

    true_distance_m: float
    wheel_distance_m: float
    true_turn_rad: float
    wheel_turn_rad: float
    lateral_m: float  # of the end, left of the start pose's x axis


def read_test(name: str) -> TestDefinition:
    """SL or SMT as the package defines it."""
    return load_test(name, CONFIG)


def new_simulator(test: TestDefinition, physics: PhysicsParams, robot: Path = ALTO) -> Simulator:
    world, params = find_world(test.world, ROOT / 'worlds'), SimulatorParams(physics=physics)
    return Simulator(world, RobotSource(robot), params, test.start.pose(), seed=0)


def record_drive(simulator: Simulator, test: TestDefinition) -> Drive:
    """Drive the test's script, then stand for a second; a sample every 50 ms, of angles since the start."""
    script, stamps_ns, angles_rad, poses = ScriptedDrive(test), [], [], []
    for report in range(math.ceil((script.duration_s + SETTLING_S) * REPORTS_PER_SECOND) + 1):
        joints = simulator.joint_states()
        stamps_ns.append(joints.stamp_ns)
        angles_rad.append(joints.angles_rad)
        poses.append(simulator.physics.base_pose_in_plane())
        simulator.command(*script.command_at(report / REPORTS_PER_SECOND, 1.0 / REPORTS_PER_SECOND))
        for _ in range(TICKS_PER_REPORT):
            simulator.tick()
    return Drive(np.array(stamps_ns), np.subtract(angles_rad, angles_rad[0]), np.array(poses))


def compare(drive: Drive) -> Comparison:
    """Distances along the path and angles with whole turns counted."""
    steps = minus(drive.true_poses[1:], drive.true_poses[:-1])
    left_m, right_m = WHEEL_RADIUS_M * drive.wheel_angles_rad[-1]
    start, end = (Pose2D(*pose) for pose in drive.true_poses[[0, -1]].tolist())
    return Comparison(
        float(np.hypot(steps[:, 0], steps[:, 1]).sum()),
        0.5 * (left_m + right_m),
        float(steps[:, 2].sum()),
        (right_m - left_m) / WHEEL_SEPARATION_M,
        end.relative_to(start).y_m,
    )


def cruise_cost_us(simulator: Simulator, test: TestDefinition) -> float:
    """Best processor time of PyBullet's bare 10 ms, at the test's top speed, of this robot with its motors running."""
    straight = test.drive[0].straight is not None
    command = (test.limits.speed, 0.0) if straight else (0.0, test.limits.angular_speed)
    simulator.reset_world()
    costs_s = []
    for _ in range(WINDOWS):
        simulator.command(*command)
        for _ in range(WINDOW_TICKS):
            simulator.tick()
        began_s = time.thread_time()
        for _ in range(WINDOW_TICKS):
            simulator.physics._bullet.stepSimulation()
        costs_s.append(time.thread_time() - began_s)
    return min(costs_s) / WINDOW_TICKS * 1e6
