"""Limits of the drive, by plugins, controllers and the URDF's joint limits."""

from __future__ import annotations

import math
from typing import Dict, Iterator, Sequence, Tuple

from diff_encoder_sim.robots.coaxial_pairs import WheelPair
from diff_encoder_sim.robots.drive_train import DriveTrain
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.grip import (
    most_torque_nm,
    sensible_acceleration_mps2,
    sensible_turn_acceleration_radps2,
    torque_accelerations,
)
from diff_encoder_sim.robots.robot_description import GroundContact, MassProperties
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.wheel_geometry import WheelGeometry

FASTEST_MPS = 5.0  # a joint's limit beyond it is a placeholder
SLOWEST_MPS = 0.05

_UNITS = {
    'wheel_torque': 'wheel torque [N m]',
    'max_linear_speed': 'highest speed [m/s]',
    'max_angular_speed': 'highest turning rate [rad/s]',
    'max_linear_acceleration': 'highest acceleration [m/s^2]',
    'max_angular_acceleration': 'highest angular acceleration [rad/s^2]',
}

# Of config/simulator.yaml, where the robot's file gives none; its torque is ALTO's, and no other's.
USUAL_LIMITS = {
    'wheel_torque': math.inf,
    'max_linear_speed': 1.0,
    'max_angular_speed': 2.0,
    'max_linear_acceleration': 1.5,
    'max_angular_acceleration': 6.0,
}

_ACCELERATIONS = ('max_linear_acceleration', 'max_angular_acceleration')
LEAST_ACCELERATION = 0.01  # m/s^2, rad/s^2: motors with less torque fail the self-check

Limit = Tuple[str, float, str]  # key of DriveParams, value, source


def drive_limits(
    tree: RobotTree, drive: DriveTrain, mass: MassProperties, contacts: Sequence[GroundContact], seen: Findings
) -> Dict[str, float]:
    """Return the limits that the robot's file gives, by keys of DriveParams; the first source of each counts.

    Torque and acceleration are never more than the floor takes: plugins give 10 N m and more to robots of 1 kg, and
    10 m/s^2, which a real motor does not have, and which only lets wheels slip. Without an acceleration in the file it
    is this package's usual one, or a smaller one which the motors' torque allows.
    """
    limits: Dict[str, Tuple[float, str]] = {}
    for key, value, source in [*_by_drives(drive), *_by_joints(tree, drive.pair, drive.geometry, seen)]:
        limits.setdefault(key, (value, source))
    most_nm = most_torque_nm(mass.mass_kg, drive.base.radius_m)
    most_mps2 = sensible_acceleration_mps2(mass, contacts, drive.base)
    separation_m = drive.geometry.separation_m
    turning_radps2 = sensible_turn_acceleration_radps2(mass, contacts, drive.base, separation_m)
    most_radps2 = min(2.0 * most_mps2 / separation_m, turning_radps2)
    _cut(limits, 'wheel_torque', most_nm, 'mass x g x wheel radius: more only slips')
    by_torque = torque_accelerations(limits['wheel_torque'][0], mass, drive.base, separation_m)
    for key, by_grip, by_motors in zip(_ACCELERATIONS, (most_mps2, most_radps2), by_torque):
        if key not in limits and by_motors < by_grip:
            _cut(limits, key, max(LEAST_ACCELERATION, by_motors), "half of the motors' torque")
        else:
            _cut(limits, key, by_grip, "half of the wheels' grip")
    for key, unit in _UNITS.items():
        value, source = limits.get(key, (USUAL_LIMITS[key], "this package's default: the robot's file gives none"))
        seen.add(unit, f'{value:.4g}', source)
    return {key: value for key, (value, _) in limits.items()}


def _cut(limits: Dict[str, Tuple[float, str]], key: str, most: float, reason: str) -> None:
    """Lower a limit, given or usual, to what makes sense."""
    value, source = limits.get(key, (USUAL_LIMITS[key], ''))
    if value > most:
        limits[key] = most, f'{reason} (given by {source}: {value:.4g})' if source else reason


def _by_drives(drive: DriveTrain) -> Iterator[Limit]:
    for tags in drive.drives:
        for key, value in tags.limits.items():
            if key == 'rim_acceleration':
                yield 'max_linear_acceleration', value, tags.source
                yield 'max_angular_acceleration', 2.0 * value / drive.geometry.separation_m, tags.source
            else:
                yield key, value, tags.source


def _by_joints(tree: RobotTree, pair: WheelPair, geometry: WheelGeometry, seen: Findings) -> Iterator[Limit]:
    """Yield what the joints' limits allow; zero stands for none."""
    joints = [tree.joints[name] for name in pair.joints]
    efforts_nm = [joint.effort for joint in joints if joint.effort]
    speeds_radps = [joint.speed for joint in joints if joint.speed]
    if efforts_nm:
        yield 'wheel_torque', min(efforts_nm), "the joints' effort limit"
    if not speeds_radps:
        return
    speed_mps = min(speeds_radps) * 0.5 * geometry.diameter_m
    if speed_mps < SLOWEST_MPS:
        seen.warn(
            f"the joints' velocity limit of {min(speeds_radps):.3g} rad/s, {speed_mps:.2g} m/s, "
            'is left out: too slow to drive'
        )
    elif speed_mps <= FASTEST_MPS:
        yield 'max_linear_speed', speed_mps, "the joints' velocity limit"
        yield 'max_angular_speed', 2.0 * speed_mps / geometry.separation_m, "the joints' velocity limit"
