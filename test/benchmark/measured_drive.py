"""Drives the simulated robot through a test and compares truth with wheel angles."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import List, NamedTuple, Tuple

from bench import ALTO, CONFIG, ROOT

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import TICK_S
from diff_encoder_sim.trials.scripted_drive import SETTLING_S, ScriptedDrive

WHEEL_RADIUS_M = 0.1
WHEEL_SEPARATION_M = 0.4

REPORTS_PER_SECOND = 20
TICKS_PER_REPORT = round(1.0 / (REPORTS_PER_SECOND * TICK_S))

WINDOW_TICKS, WINDOWS = 50, 25  # half a second of simulated time, of which some have the caches to themselves


class Row(NamedTuple):
    """The robot at one report of its encoder."""

    stamp_ns: int
    angles_rad: Tuple[float, float]  # turned since the start, left and right
    true_pose: Pose2D  # in the world


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
    """The test's world with the robot at its start."""
    return Simulator(
        find_world(test.world, ROOT / 'worlds'), robot, SimulatorParams(physics=physics), test.start.pose(), seed=0
    )


def record_drive(simulator: Simulator, test: TestDefinition) -> List[Row]:
    """Drive the test's script, then stand for a second; one row every 50 ms."""
    script = ScriptedDrive(test)
    start_angles_rad = simulator.joint_states().angles_rad
    rows = [_row(simulator, start_angles_rad)]
    for report in range(math.ceil((script.duration_s + SETTLING_S) * REPORTS_PER_SECOND)):
        simulator.command(*script.command_at(report / REPORTS_PER_SECOND, 1.0 / REPORTS_PER_SECOND))
        for _ in range(TICKS_PER_REPORT):
            simulator.tick()
        rows.append(_row(simulator, start_angles_rad))
    return rows


def compare(rows: List[Row]) -> Comparison:
    """Distances along the path and angles with whole turns counted."""
    distance_m = turn_rad = 0.0
    for before, after in zip(rows, rows[1:]):
        step = after.true_pose.relative_to(before.true_pose)
        distance_m += math.hypot(step.x_m, step.y_m)
        turn_rad += wrap_angle(step.yaw_rad)
    left_m, right_m = (WHEEL_RADIUS_M * angle_rad for angle_rad in rows[-1].angles_rad)
    return Comparison(
        distance_m,
        0.5 * (left_m + right_m),
        turn_rad,
        (right_m - left_m) / WHEEL_SEPARATION_M,
        rows[-1].true_pose.relative_to(rows[0].true_pose).y_m,
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
            simulator._physics._bullet.stepSimulation()
        costs_s.append(time.thread_time() - began_s)
    return min(costs_s) / WINDOW_TICKS * 1e6


def _row(simulator: Simulator, start_angles_rad: Tuple[float, ...]) -> Row:
    joints = simulator.joint_states()
    left_rad, right_rad = (angle_rad - start_rad for angle_rad, start_rad in zip(joints.angles_rad, start_angles_rad))
    return Row(joints.stamp_ns, (left_rad, right_rad), simulator.base_pose_in_world())
