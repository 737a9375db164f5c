"""The two driven wheels: diameter, separation, limits and grip."""

from __future__ import annotations

import math
from typing import Dict, Iterator, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import WheelBase
from diff_encoder_sim.robots.description import (
    DriveWheel,
    Findings,
    GroundContact,
    MassProperties,
    RobotChoices,
    RobotTree,
)
from diff_encoder_sim.robots.driven_wheels import DriveTags, choose_wheels, controllers, drive_plugins
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, WheelPair, rolling_wheels

AGREE = 0.005  # relative difference that is not worth a line
# A controller's number that differs by more is a mistake in it, such as a radius for a diameter; by less it is a wheel
# measured while it rolls under load.
MEASURED = 0.1
LARGEST_M = 2.0  # of a wheel on a robot that drives indoors


class WheelGeometry(NamedTuple):
    """What controller and odometry assume of both wheels, and what the physics builds."""

    diameter_m: float
    separation_m: float  # between the contact points


def wheel_geometry(
    where: str, pair: WheelPair, drives: Sequence[DriveTags], choices: RobotChoices, seen: Findings
) -> WheelGeometry:
    """Return the nominal geometry; where from, and who disagrees, is added to what is seen.

    Args:
        where: begins the error: the robot's file.
        pair: the driven wheels.
        drives: plugins and controllers that drive them.
        choices: the user's.
        seen: takes sources and disagreements.

    Raises:
        ConfigError: nothing gives the size of the wheels.
    """
    return WheelGeometry(
        _diameter_m(where, pair, drives, choices.wheel_diameter, seen),
        _separation_m(pair, drives, choices.wheel_separation, seen),
    )


def _diameter_m(
    where: str, pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings
) -> float:
    """Return the diameter: a controller's rather than the shape's, unless it is out of question."""
    given = _given([(tags.source, tags.diameter_m) for tags in drives])
    shape = _shape_diameter(pair, seen)
    value_m, source = shape or given or (None, '')
    if shape is not None and given is not None and _differ(shape[0], given[0]) > AGREE:
        is_measured = _differ(shape[0], given[0]) <= MEASURED
        value_m, source = given if is_measured else shape
        seen.warn(
            f'wheel diameter: {given[0]:.5g} m by {given[1]}, '
            f'{shape[0]:.5g} m by the {shape[1]}: {value_m:.5g} m is used'
        )
    elif given is not None:
        value_m, source = given
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    if value_m is None:
        raise ConfigError(
            f'{where}: given wheels {pair.left.link!r} and {pair.right.link!r} without a round shape; '
            'allowed: a collision cylinder, sphere or round mesh on the axle, or simulator.wheel_diameter'
        )
    if value_m > LARGEST_M:
        seen.warn(f'wheels of {value_m:.5g} m: a URDF is in metres; are its lengths in mm?')
    seen.add('wheel diameter [m]', f'{value_m:.5g}', source)
    return value_m


def _shape_diameter(pair: WheelPair, seen: Findings) -> Optional[Tuple[float, str]]:
    """Return the mean diameter of the shapes, and which they are."""
    left_m, right_m = pair.left.radius_m, pair.right.radius_m
    if left_m is None or right_m is None:
        one_m = left_m or right_m
        return None if one_m is None else (2.0 * one_m, f'{(pair.left if left_m else pair.right).shape}')
    if _differ(left_m, right_m) > 1e-4:
        seen.warn(
            f'the wheels differ: diameters {2 * left_m:.5g} m (left) and {2 * right_m:.5g} m (right) by their shapes; '
            'both are simulated with the nominal one'
        )
    return left_m + right_m, pair.left.shape


def _separation_m(pair: WheelPair, drives: Sequence[DriveTags], chosen_m: Optional[float], seen: Findings) -> float:
    """Return the separation: the shapes', unless the user knows better."""
    value_m = float(pair.left.centre_m[1] - pair.right.centre_m[1])
    source = 'middles of the wheels' if pair.left.radius_m else 'joints of the wheels'
    given = _given([(tags.source, tags.separation_m) for tags in drives])
    if given is not None and _differ(value_m, given[0]) > AGREE:
        seen.warn(
            f'wheel separation: {given[0]:.5g} m by {given[1]}, {value_m:.5g} m between the {source}, which is used'
        )
    if chosen_m is not None:
        value_m, source = chosen_m, 'given'
    seen.add('wheel separation [m]', f'{value_m:.5g}', source)
    return value_m


def _given(given: Sequence[Tuple[str, Optional[float]]]) -> Optional[Tuple[float, str]]:
    return next(((value_m, source) for source, value_m in given if value_m is not None), None)


def _differ(a: float, b: float) -> float:
    """Return the relative difference."""
    return abs(a - b) / max(a, b)


CENTRED_M = 5e-4


class DriveTrain(NamedTuple):
    """What drives the robot."""

    pair: WheelPair  # as the file has it
    geometry: WheelGeometry  # nominal
    left: DriveWheel
    right: DriveWheel
    base: WheelBase
    drives: Tuple[DriveTags, ...]  # plugins and controllers, those of these wheels


def find_drive(tree: RobotTree, choices: RobotChoices, seen: Findings) -> DriveTrain:
    """Return the drive of a robot whose meshes are replaced.

    Raises:
        ConfigError: the robot has no two driven wheels on one axle, or they have no size.
    """
    wheels = rolling_wheels(tree)
    drives = drive_plugins(tree, wheels) + controllers(tree, wheels)
    pair = choose_wheels(tree, wheels, drives, choices, seen)
    ours = tuple(tags for tags in drives if set(pair.joints) <= set(tags.left_joints + tags.right_joints))
    geometry = wheel_geometry(tree.where, pair, ours, choices, seen)
    left, right = _driven(pair.left, geometry, pair), _driven(pair.right, geometry, pair)
    base = _wheel_base(tree, left, right, geometry)
    place = f'x = {round(base.axle_x_m, 6) + 0.0:.4g} m, {1e3 * (base.floor_z_m + base.radius_m):.4g} mm up'
    seen.add('axle', place, 'wheels, in the base frame')
    _check_centred(left, right, seen)
    return DriveTrain(pair, geometry, left, right, base, ours)


def _driven(wheel: RollingWheel, geometry: WheelGeometry, pair: WheelPair) -> DriveWheel:
    """Return a driven wheel, moved along the axle to where the nominal separation has it."""
    middle_m = 0.5 * float(pair.left.centre_m[1] + pair.right.centre_m[1])
    x_m, _, z_m = wheel.centre_m.tolist()
    y_m = middle_m + (0.5 if wheel is pair.left else -0.5) * geometry.separation_m
    radius_m = wheel.radius_m or 0.5 * geometry.diameter_m
    return DriveWheel(wheel.joint, wheel.link, (x_m, y_m, z_m), radius_m, bool(wheel.axis[1] > 0.0))


def _wheel_base(tree: RobotTree, left: DriveWheel, right: DriveWheel, geometry: WheelGeometry) -> WheelBase:
    links = (*tree.subtree(left.link), *tree.subtree(right.link))
    middle_x_m, middle_z_m = (0.5 * (left.centre_m[axis] + right.centre_m[axis]) for axis in (0, 2))
    return WheelBase(middle_x_m, middle_z_m - 0.5 * geometry.diameter_m, 0.5 * geometry.diameter_m, links)


def _check_centred(left: DriveWheel, right: DriveWheel, seen: Findings) -> None:
    middle_m = 0.5 * (left.centre_m[1] + right.centre_m[1])
    if abs(middle_m) > CENTRED_M:
        side = 'left' if middle_m > 0.0 else 'right'
        seen.warn(
            f"the wheels' middle is {1e3 * abs(middle_m):.1f} mm to the {side} of the base frame's x axis: "
            'odometry, which takes it to be on it, errs by up to twice that in turns'
        )


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


G_MPS2 = 9.81
LEAST_SHARE = 0.1
MARGIN = 0.5  # of the grip: braking and bumps need the rest


def most_torque_nm(mass_kg: float, wheel_radius_m: float) -> float:
    """Return the torque at which one wheel would slip if it carried the whole robot on a floor of friction 1."""
    return mass_kg * G_MPS2 * wheel_radius_m


def sensible_acceleration_mps2(mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase) -> float:
    """Return half of the acceleration at which the wheels slip on a floor of friction 1.

    The robot leans on the contact on its centre of mass's side, at c from the axle; the centre of mass is d from the
    axle on that side, and h above the floor. The wheels carry 1 - d / c of the weight, less m a h / c when accelerating
    away from that contact: so a = g (1 - d / c) / (1 + h / c).
    """
    load = _load(mass, contacts, wheels)
    if load.arm_m is None:
        return MARGIN * G_MPS2
    height_m = max(0.0, float(mass.com_m[2]) - wheels.floor_z_m)
    return MARGIN * G_MPS2 * load.share / (1.0 + height_m / load.arm_m)


def sensible_turn_acceleration_radps2(
    mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase, separation_m: float
) -> float:
    """Return half of the angular acceleration in place at which the wheels slip on a floor of friction 1.

    Both wheels push with half of their load m g (1 - d / c), at L / 2 from the axle's middle.
    """
    force_n = MARGIN * G_MPS2 * mass.mass_kg * _load(mass, contacts, wheels).share
    return force_n * 0.5 * separation_m / turning_inertia_kgm2(mass, wheels)


def torque_accelerations(
    torque_nm: float, mass: MassProperties, wheels: WheelBase, separation_m: float
) -> Tuple[float, float]:
    """Return half of the acceleration [m/s^2] and angular acceleration [rad/s^2] that two motors can give the body."""
    force_n = MARGIN * 2.0 * torque_nm / wheels.radius_m
    return force_n / mass.mass_kg, force_n * 0.5 * separation_m / turning_inertia_kgm2(mass, wheels)


def turning_inertia_kgm2(mass: MassProperties, wheels: WheelBase) -> float:
    """Return the moment of inertia about the upright axis through the axle's middle, which lies on y = 0."""
    x_m, y_m = float(mass.com_m[0]) - wheels.axle_x_m, float(mass.com_m[1])
    return float(mass.inertia_kgm2[2, 2]) + mass.mass_kg * (x_m**2 + y_m**2)


class _Load(NamedTuple):
    """How the robot leans on a contact."""

    share: float  # of the weight, on the driven wheels at rest
    arm_m: Optional[float]  # of that contact from the axle; None without one


def _load(mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase) -> _Load:
    ahead_m = float(mass.com_m[0]) - wheels.axle_x_m
    side = 1.0 if ahead_m > 0 else -1.0
    arms_m = [side * (contact.point_m[0] - wheels.axle_x_m) for contact in contacts]
    arm_m = min((arm for arm in arms_m if arm > abs(ahead_m)), default=None)
    return _Load(1.0 if arm_m is None else max(LEAST_SHARE, 1.0 - abs(ahead_m) / arm_m), arm_m)
