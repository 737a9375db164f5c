"""Whether a robot drives as its wheels turn, stands on them, has the torque, and where its scanner is."""

from __future__ import annotations

import math
from typing import Dict, Iterator, List, NamedTuple

from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.simulation.check_results import Check
from diff_encoder_sim.simulation.drive import DriveParams
from diff_encoder_sim.simulation.flat_drive import FlatDrive, FlatFloor
from diff_encoder_sim.simulation.own_view import check_laser
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2
from diff_encoder_sim.simulation.simulator import SimulatorParams

SPEEDS_MPS = (0.1, 1.0)  # or the robot's limit
TOLERANCE = 1e-3  # truth against wheels, relative
# A robot that drives straight may turn by so much unnoticed by its wheels: 0.1 % of the way to the side.
TOLERANCE_RADPM = 2e-3
LEAST_WHEEL_LOAD = 0.1  # of the weight, on each wheel
LARGEST_PITCH_AT_REST_DEG, LARGEST_PITCH_DEG = 1.0, 5.0
LEAST_REACHED = 0.98  # of the commanded speed, when the ramp is over

STANDSTILL = 1e-3  # m or rad: a drive that is none

_SLIP_ADVICE = 'the robot slips or tips: see weight, pitch and torque; lower accelerations in simulator.drive'


class _Drives(NamedTuple):
    """Drives both ways at each speed."""

    straight: List[FlatDrive]
    turning: List[FlatDrive]


def self_check(robot: SimulatedRobot, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor of its own, within its own limits, and return what was found; it takes a second."""
    floor = FlatFloor(robot, params.drive, params.physics)
    try:
        loads = floor.rest()
        rest_pitch_deg = math.degrees(floor.pitch_rad())
        laser = check_laser(robot.description, floor.physics, params.lidar)
        drives = _Drives(
            [floor.straight(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)],
            [floor.turn(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)],
        )
    finally:
        floor.close()
    checks = [*_straight(drives.straight), *_turns(drives.turning), _weight(robot, loads)]
    return [*checks, _pitch(rest_pitch_deg, drives.straight), _torque(robot, params.drive, drives), laser]


def _straight(drives: List[FlatDrive]) -> Iterator[Check]:
    """Compare truth and wheels straight ahead and back."""
    for name, same_way in (('straight, forward', drives[0::2]), ('straight, backward', drives[1::2])):
        distance = max(_relative(drive.true_distance_m, drive.wheel_distance_m) for drive in same_way)
        turn_radpm = max(
            _ratio(drive.true_turn_rad - drive.wheel_turn_rad, drive.wheel_distance_m) for drive in same_way
        )
        value = (
            f'at {_speeds(same_way)} m/s truth and wheels differ by {100 * distance:.4f} % of the distance, '
            f'{math.degrees(turn_radpm):.4f} deg/m'
        )
        yield _judged(name, value, distance <= TOLERANCE and turn_radpm <= TOLERANCE_RADPM, _SLIP_ADVICE)


def _turns(drives: List[FlatDrive]) -> Iterator[Check]:
    """Compare truth and wheels in turns in place."""
    for name, same_way in (('turn, left', drives[0::2]), ('turn, right', drives[1::2])):
        angle = max(_relative(drive.true_turn_rad, drive.wheel_turn_rad) for drive in same_way)
        value = f'at {_speeds(same_way)} rad/s truth and wheels differ by {100 * angle:.4f} % of the angle'
        yield _judged(name, value, angle <= TOLERANCE, _SLIP_ADVICE)


def _weight(robot: SimulatedRobot, loads: Dict[str, float]) -> Check:
    """Check that the driven wheels carry what they need to drive."""
    weight_n = robot.description.mass.mass_kg * GRAVITY_MPS2
    left, right = (loads.get(joint, 0.0) for joint in robot.joints)
    value = f'left {left * weight_n:.3g} N ({100 * left:.0f} %), right {right * weight_n:.3g} N ({100 * right:.0f} %)'
    value += f' of {weight_n:.3g} N'
    advice = 'the rest is on casters: a centre of mass (of the <inertial> tags) nearer to the axle'
    return _judged('weight on the driven wheels', value, min(left, right) >= LEAST_WHEEL_LOAD, advice)


def _pitch(at_rest_deg: float, drives: List[FlatDrive]) -> Check:
    lowest_deg = math.degrees(min(drive.pitches_rad[0] for drive in drives))
    highest_deg = math.degrees(max(drive.pitches_rad[1] for drive in drives))
    at_rest, lowest, highest = (f'{round(pitch, 2) + 0.0:.2f}' for pitch in (at_rest_deg, lowest_deg, highest_deg))
    value = f'at rest {at_rest} degrees, {lowest} to {highest} while speeding up and braking'
    is_ok = abs(at_rest_deg) <= LARGEST_PITCH_AT_REST_DEG and max(-lowest_deg, highest_deg) <= LARGEST_PITCH_DEG
    advice = (
        'it tips over: a lower centre of mass, nearer to the axle, or a lower simulator.drive.max_linear_acceleration'
    )
    return _judged('pitch', value, is_ok, advice)


def _torque(robot: SimulatedRobot, params: DriveParams, drives: _Drives) -> Check:
    """Check that the motors follow the ramps of their controller."""
    mass, wheels = robot.description.mass, robot.wheels
    radius_m = max(wheels.left_radius_m, wheels.right_radius_m)
    straight_nm = 0.5 * mass.mass_kg * params.max_linear_acceleration * radius_m
    turning_nm = mass.inertia_kgm2[2, 2] * params.max_angular_acceleration * radius_m / wheels.separation_m
    reached = min(drive.reached for drive in drives.straight + drives.turning)
    value = (
        f'{100 * reached:.0f} % of the speed at the end of the ramp; '
        f'{max(straight_nm, turning_nm):.3g} of {params.wheel_torque:.3g} N m for the body alone'
    )
    advice = 'a higher simulator.drive.wheel_torque, or lower accelerations'
    return _judged('torque', value, reached >= LEAST_REACHED, advice)


def _speeds(drives: List[FlatDrive]) -> str:
    return ' and '.join(f'{abs(drive.speed):.3g}' for drive in drives)


def _judged(name: str, value: str, is_ok: bool, advice: str) -> Check:
    return Check(name, value, is_ok, '' if is_ok else advice)


def _relative(true: float, by_wheels: float) -> float:
    return _ratio(true - by_wheels, by_wheels)


def _ratio(difference: float, way: float) -> float:
    """Return the size of a difference over that of a way; infinite for a robot that did not move."""
    return abs(difference / way) if abs(way) > STANDSTILL else math.inf
