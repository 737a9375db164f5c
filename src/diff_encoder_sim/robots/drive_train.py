"""The two driven wheels: diameter, separation, limits and grip."""

from __future__ import annotations

import math
from typing import Dict, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import DriveTrain, Findings, GroundContact, RobotChoices, RobotTree
from diff_encoder_sim.robots.drive_tags import DriveTags, find_drive_tags
from diff_encoder_sim.robots.driven_wheels import WheelPair, choose_wheels, drivable_joints, joints_of, rolling_wheels
from diff_encoder_sim.robots.solids import MassProperties

AGREE = 0.005  # relative difference that is not worth a line
# A plugin's number that differs by more is a mistake in it, such as a radius for a diameter; by less it is a wheel
# measured while it rolls under load.
MEASURED = 0.1
LARGEST_M = 2.0  # of a wheel on a robot that drives indoors
CENTRED_M = 5e-4

G_MPS2 = 9.81
LEAST_SHARE = 0.1
MARGIN = 0.5  # of the grip: braking and bumps need the rest
FASTEST_MPS = 5.0  # a joint's limit beyond it is a placeholder
SLOWEST_MPS = 0.05
LEAST_ACCELERATION = 0.01  # m/s^2, rad/s^2: motors with less torque fail the self-check

_QUANTITIES = {
    'wheel_torque': 'wheel torque [N m]',
    'max_linear_speed': 'highest speed [m/s]',
    'max_angular_speed': 'highest turning rate [rad/s]',
    'max_linear_acceleration': 'highest acceleration [m/s^2]',
    'max_angular_acceleration': 'highest angular acceleration [rad/s^2]',
}
# Of config/simulator.yaml, if the robot's file gives none; its torque is ALTO's, and no other's.
USUAL_LIMITS = {
    'wheel_torque': math.inf,
    'max_linear_speed': 1.0,
    'max_angular_speed': 2.0,
    'max_linear_acceleration': 1.5,
    'max_angular_acceleration': 6.0,
}


def find_drive(
    tree: RobotTree, choices: RobotChoices, seen: Findings
) -> Tuple[DriveTrain, WheelPair, Tuple[DriveTags, ...]]:
    """Return the drive of a robot whose meshes are replaced, its wheels as in the file, and their plugins.

    Raises:
        ConfigError: the robot has no two driven wheels on one axle, or they have no size.
    """
    wheels = rolling_wheels(tree)
    drives = find_drive_tags(tree, wheels, drivable_joints(tree, wheels))
    pair = choose_wheels(tree, wheels, drives, choices, seen)
    ours = tuple(tags for tags in drives if set(joints_of(pair)) <= set(tags.left_joints + tags.right_joints))
    diameter_m = _diameter_m(tree.where, pair, ours, choices.wheel_diameter, seen)
    separation_m = _separation_m(pair, ours, choices.wheel_separation, seen)
    # Moved along the axle to their places at the nominal separation.
    middle_m = 0.5 * (pair[0].centre_m[1] + pair[1].centre_m[1])
    left, right = (
        wheel._replace(
            centre_m=(wheel.centre_m[0], middle_m + half_m, wheel.centre_m[2]),
            radius_m=wheel.radius_m or 0.5 * diameter_m,
        )
        for wheel, half_m in zip(pair, (0.5 * separation_m, -0.5 * separation_m))
    )
    drive = DriveTrain(left, right, diameter_m, separation_m)
    place = f'x = {round(drive.axle_x_m, 6) + 0.0:.4g} m, {1e3 * (drive.floor_z_m + drive.radius_m):.4g} mm up'
    seen.add('axle', place, 'wheels, in the base frame')
    if abs(drive.middle_y_m) > CENTRED_M:
        side = 'left' if drive.middle_y_m > 0.0 else 'right'
        seen.warn(
            f"the wheels' middle is {1e3 * abs(drive.middle_y_m):.1f} mm to the {side} of the base frame's x axis: "
            'odometry, which takes it to be on it, errs by up to twice that in turns'
        )
    return drive, pair, ours


def _diameter_m(
    where: str, pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings
) -> float:
    """Return the diameter: a plugin's rather than the shape's, unless it is out of question."""
    given = next(((tags.diameter_m, tags.source) for tags in drives if tags.diameter_m is not None), None)
    round_ones = [wheel for wheel in pair if wheel.radius_m]
    radii_m = [wheel.radius_m or 0.0 for wheel in round_ones]
    shape = (2.0 * sum(radii_m) / len(radii_m), round_ones[0].shape) if round_ones else None
    if shape is not None and _differ(radii_m[0], radii_m[-1]) > 1e-4:
        seen.warn(
            f'the wheels differ: diameters {2 * radii_m[0]:.5g} m (left) and {2 * radii_m[1]:.5g} m (right) by '
            'their shapes; both are simulated with the nominal one'
        )
    if chosen_m is None and shape is None and given is None:
        raise ConfigError(
            f'{where}: given wheels {pair[0].link!r} and {pair[1].link!r} without a round shape; '
            'allowed: a collision cylinder, sphere or round mesh on the axle, or simulator.wheel_diameter'
        )
    value_m, source = given or shape or (0.0, '')
    if shape is not None and given is not None and _differ(shape[0], given[0]) > AGREE:
        value_m, source = given if _differ(shape[0], given[0]) <= MEASURED else shape
        by = f'{given[0]:.5g} m by {given[1]}, {shape[0]:.5g} m by the {shape[1]}'
        seen.warn(f'wheel diameter: {by}: {value_m:.5g} m is used')
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    if value_m > LARGEST_M:
        seen.warn(f'wheels of {value_m:.5g} m: a URDF is in metres; are its lengths in mm?')
    seen.add('wheel diameter [m]', f'{value_m:.5g}', source)
    return value_m


def _separation_m(pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings) -> float:
    """Return the separation: the shapes', unless the user gives another."""
    value_m = pair[0].centre_m[1] - pair[1].centre_m[1]
    source = 'middles of the wheels' if pair[0].radius_m else 'joints of the wheels'
    given = next(((tags.separation_m, tags.source) for tags in drives if tags.separation_m is not None), None)
    if given is not None and _differ(value_m, given[0]) > AGREE:
        between = f'{value_m:.5g} m between the {source}, which is used'
        seen.warn(f'wheel separation: {given[0]:.5g} m by {given[1]}, {between}')
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    seen.add('wheel separation [m]', f'{value_m:.5g}', source)
    return value_m


def _differ(a: float, b: float) -> float:
    """Return the relative difference."""
    return abs(a - b) / max(a, b)


def drive_limits(
    tree: RobotTree,
    drive: DriveTrain,
    drives: Sequence[DriveTags],
    mass: MassProperties,
    contacts: Sequence[GroundContact],
    seen: Findings,
) -> Dict[str, float]:
    """Return the limits that the robot's file gives, by keys of DriveParams; the first source of each counts.

    Torque and acceleration are never more than the floor takes: plugins give 10 N m and more to robots of 1 kg, and
    10 m/s^2, which a real motor does not have, and which only lets wheels slip. Without an acceleration in the file it
    is this package's usual one, or a smaller one which the motors' torque allows.
    """
    limits: Dict[str, Tuple[float, str]] = {}  # with their sources
    per_rim = {'linear': 1.0, 'angular': 2.0 / drive.wheel_separation_m}
    for tags in drives:
        for key, value in tags.limits.items():
            by_rim = {f'max_{kind}_acceleration': factor * value for kind, factor in per_rim.items()}
            for name, limit in (by_rim if key == 'rim_acceleration' else {key: value}).items():
                limits.setdefault(name, (limit, tags.source))
    joints = [tree.joints[wheel.joint] for wheel in (drive.left, drive.right)]  # a limit of zero means none
    efforts_nm = [joint.effort for joint in joints if joint.effort]
    speed_radps = min((joint.speed for joint in joints if joint.speed), default=math.inf)
    speed_mps = speed_radps * drive.radius_m
    if efforts_nm:
        limits.setdefault('wheel_torque', (min(efforts_nm), "the joints' effort limit"))
    if speed_mps < SLOWEST_MPS:
        slow = f'{speed_radps:.3g} rad/s, {speed_mps:.2g} m/s'
        seen.warn(f"the joints' velocity limit of {slow}, is left out: too slow to drive")
    elif speed_mps <= FASTEST_MPS:
        for kind, factor in per_rim.items():
            limits.setdefault(f'max_{kind}_speed', (factor * speed_mps, "the joints' velocity limit"))

    def cut(key: str, most: float, reason: str) -> None:
        value, source = limits.get(key, (USUAL_LIMITS[key], ''))
        if value > most:
            limits[key] = most, f'{reason} (given by {source}: {value:.4g})' if source else reason

    cut('wheel_torque', mass.mass_kg * G_MPS2 * drive.radius_m, 'mass x g x wheel radius: more only slips')
    grip_mps2, grip_radps2 = grip_accelerations(mass, contacts, drive)
    by_grip = grip_mps2, min(per_rim['angular'] * grip_mps2, grip_radps2)
    by_torque = torque_accelerations(limits['wheel_torque'][0], mass, drive)
    for key, most, by_motors in zip(('max_linear_acceleration', 'max_angular_acceleration'), by_grip, by_torque):
        if key not in limits and by_motors < most:
            cut(key, max(LEAST_ACCELERATION, by_motors), "half of the motors' torque")
        else:
            cut(key, most, "half of the wheels' grip")
    for key, quantity in _QUANTITIES.items():
        value, source = limits.get(key, (USUAL_LIMITS[key], "this package's default: the robot's file gives none"))
        seen.add(quantity, f'{value:.4g}', source)
    return {key: value for key, (value, _) in limits.items()}


def grip_accelerations(
    mass: MassProperties, contacts: Sequence[GroundContact], drive: DriveTrain
) -> Tuple[float, float]:
    """Return half of the accelerations [m/s^2] and [rad/s^2] at which the wheels slip on a floor of friction 1.

    The robot leans on the contact on its centre of mass's side, at c from the axle; the centre of mass is d from the
    axle on that side, and h above the floor. The wheels carry 1 - d / c of the weight, less m a h / c when accelerating
    away from that contact: so a = g (1 - d / c) / (1 + h / c). In a turn in place both wheels push with half of their
    load m g (1 - d / c), at L / 2 from the axle's middle.
    """
    ahead_m = float(mass.com_m[0]) - drive.axle_x_m
    side = 1.0 if ahead_m > 0 else -1.0
    arms_m = [side * (contact.point_m[0] - drive.axle_x_m) for contact in contacts]
    arm_m = min((arm for arm in arms_m if arm > abs(ahead_m)), default=math.inf)
    share = max(LEAST_SHARE, 1.0 - abs(ahead_m) / arm_m)
    height_m = max(0.0, float(mass.com_m[2]) - drive.floor_z_m)
    turn_radps2 = _turn_radps2(MARGIN * G_MPS2 * mass.mass_kg * share, mass, drive)
    return MARGIN * G_MPS2 * share / (1.0 + height_m / arm_m), turn_radps2


def torque_accelerations(torque_nm: float, mass: MassProperties, drive: DriveTrain) -> Tuple[float, float]:
    """Return half of the acceleration [m/s^2] and angular acceleration [rad/s^2] that two motors can give the body."""
    force_n = MARGIN * 2.0 * torque_nm / drive.radius_m
    return force_n / mass.mass_kg, _turn_radps2(force_n, mass, drive)


def _turn_radps2(force_n: float, mass: MassProperties, drive: DriveTrain) -> float:
    """Return the angular acceleration of a robot whose wheels push with a force together, about the axle's middle."""
    x_m, y_m = float(mass.com_m[0]) - drive.axle_x_m, float(mass.com_m[1])
    inertia_kgm2 = float(mass.inertia_kgm2[2, 2]) + mass.mass_kg * (x_m**2 + y_m**2)
    return force_n * 0.5 * drive.wheel_separation_m / inertia_kgm2
