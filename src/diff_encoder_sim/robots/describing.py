"""The description of a differential drive by its file: wheels, contacts, laser, mass, outline, limits."""

from __future__ import annotations

import functools
import math
from typing import Dict, List, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, ground_contacts, judge_stance
from diff_encoder_sim.robots.description import (
    DrivenWheel,
    DriveTrain,
    Findings,
    GroundContact,
    RobotChoices,
    RobotDescription,
    RobotSource,
    RobotTree,
)
from diff_encoder_sim.robots.driven_wheels import DrivePlugin, DriveSearch, WheelPair, joints_of
from diff_encoder_sim.robots.laser_search import find_laser
from diff_encoder_sim.robots.meshes import MeshFinder, primitive_tree
from diff_encoder_sim.robots.solids import MassProperties, Shape, farthest_m, homogeneous, merged
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import Expansion, expansion, find_mesh

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

LIMITS = {  # by keys of DriveParams: row of the table, value of config/simulator.yaml (its torque is ALTO's only)
    'wheel_torque': ('wheel torque [N m]', math.inf),
    'max_linear_speed': ('highest speed [m/s]', 1.0),
    'max_angular_speed': ('highest turning rate [rad/s]', 2.0),
    'max_linear_acceleration': ('highest acceleration [m/s^2]', 1.5),
    'max_angular_acceleration': ('highest angular acceleration [rad/s^2]', 6.0),
}

_ROUNDING = 0.05  # principal moments of a thin plate, a = b + c, are given with few digits
_MOST_LINKS_NAMED = 3
_MOST_JOINTS_NAMED = 12
LEAST_KG = 1e-3  # of a robot
WORLD_FRAMES = ('map', 'odom')  # the robot's pose in them is published


def describe(source: RobotSource, choices: RobotChoices = RobotChoices()) -> RobotDescription:  # noqa: B008
    """Return a robot's description, the user's choices first; ConfigError without two driven wheels on one axle."""
    return _describe(expansion(source), source, choices)


@functools.lru_cache(maxsize=32)  # a campaign asks for the same robot in each of its trials
def _describe(expanded: Expansion, source: RobotSource, choices: RobotChoices) -> RobotDescription:
    tree, seen = parse_urdf(expanded.urdf, str(source.file)), Findings()
    seen.notes.extend(expanded.notes + tree.notes)
    choices = choices.model_copy(update={'laser_link': choices.laser_link or expanded.laser_link})
    return describe_tree(tree, lambda uri: find_mesh(uri, source), choices, seen)


def describe_tree(tree: RobotTree, find: MeshFinder, choices: RobotChoices, seen: Findings) -> RobotDescription:
    """Return the description of a robot whose URDF is parsed; see `describe`."""
    if tree.root in WORLD_FRAMES:
        raise ConfigError(
            f'{tree.where}: root link {tree.root!r} is the name of a frame that others publish; '
            "allowed: the robot's base as root, such as base_link"
        )
    seen.add('name', tree.name, '<robot name>')
    seen.add('base frame', tree.root, 'root link')
    simple = primitive_tree(tree, find, seen)
    search = DriveSearch(simple, seen)
    pair = search.pair(choices)
    plugins = [each for each in search.plugins if {*joints_of(pair)} <= {*each.left_joints, *each.right_joints}]
    drive = _drive_train(tree.where, pair, plugins, choices, seen)
    mass = robot_mass(simple, seen)
    com = ', '.join(f'{round(part, 6) + 0.0:.4g}' for part in mass.com_m.tolist())
    seen.add('mass [kg]', f'{mass.mass_kg:.4g}', '<inertial> of the links')
    seen.add('centre of mass', f'({com}) m', '<inertial> of the links')
    driven_links = {name for wheel in pair for name in simple.subtree(wheel.link)}
    links = [(name, simple.links[name]) for name in simple.poses]
    shapes = [(name, s.placed(simple.poses[name])) for name, link in links for s in link.collisions or link.visuals]
    contacts = ground_contacts(simple, drive, driven_links)
    judge_stance(contacts, drive, float(mass.com_m[0]), seen)
    footprint = footprint_outline([shape for _, shape in shapes], drive.floor_z_m, tree.where)
    x_m, y_m = zip(*footprint)
    extent = f'x from {min(x_m):.3f} to {max(x_m):.3f} m, y from {min(y_m):.3f} to {max(y_m):.3f} m'
    seen.add('footprint', f'{extent}, {len(footprint)} corners', 'collision shapes')
    laser = find_laser(simple, choices.laser_link, seen)
    limits = _drive_limits(tree, drive, plugins, mass, contacts, seen)
    still = [joint for joint in tree.joints.values() if joint.kind != 'fixed' and joint.name not in joints_of(pair)]
    if still:
        named = [f'{joint.name} ({joint.kind}{", mimic" if joint.is_mimic else ""})' for joint in still]
        seen.note(f'joints held still at zero: {_named(named, _MOST_JOINTS_NAMED)}')
    hull = tuple(shape for name, shape in shapes if name not in driven_links)
    return RobotDescription(**vars(drive), tree=tree, mass=mass, contacts=contacts, hull=hull, footprint=footprint,
                            laser=laser, drive_limits=limits, found=tuple(seen.found),
                            warnings=tuple(dict.fromkeys(seen.warnings)),
                            notes=tuple(dict.fromkeys(seen.notes)))  # fmt: skip


def robot_mass(tree: RobotTree, seen: Findings) -> MassProperties:
    """Return the mass of all links, absurd inertias replaced by those of homogeneous solids, with a warning each kind.

    Meshes of the tree are replaced. ConfigError if the robot has no mass, or one that no robot has.
    """
    # The shapes of all links that are fixed to one another, by link; without any, those of the robot.
    around: Dict[str, List[Shape]] = {}
    everything: List[Shape] = []
    for name, pose in tree.poses.items():
        joint, shapes = tree.above.get(name), [shape.placed(pose) for shape in tree.links[name].collisions]
        around[name] = around[joint.parent] if joint is not None and joint.kind == 'fixed' else []
        around[name] += shapes
        everything += shapes
    parts: List[MassProperties] = []
    faults: Dict[str, List[str]] = {}  # links by kind
    for name, link in tree.links.items():
        mass = link.inertial
        if mass is None:
            continue
        com_m, moments = mass.moved(tree.poses[name]).com_m, np.linalg.eigvalsh(mass.inertia_kgm2)
        reach_m = farthest_m(around[name] or everything, com_m) or np.inf
        gyration_m = float(np.sqrt(max(moments[2], 0.0) / mass.mass_kg))
        kind, detail = '', 'principal moments ' + ', '.join(f'{moment:.3g}' for moment in moments) + ' kg m^2'
        if moments[0] <= 0:
            kind = 'an inertia that is not positive'
        elif not mass.can_be_of_a_body(_ROUNDING):
            kind = 'an inertia of no body, one principal moment larger than the sum of the others'
        elif gyration_m > reach_m:
            kind = 'an inertia of a body larger than its shapes'
            detail = f'{moments[2]:.3g} kg m^2 of {mass.mass_kg:.3g} kg: a radius of gyration of '
            detail += f'{1e3 * gyration_m:.0f} mm, shapes within {1e3 * reach_m:.0f} mm'
        if kind:
            faults.setdefault(kind, []).append(f'{name} ({detail})')
            solid = homogeneous(link.collisions or link.visuals, mass.mass_kg)
            mass = mass._replace(inertia_kgm2=solid.inertia_kgm2)
        parts.append(mass.moved(tree.poses[name]))
    for kind, links in faults.items():
        seen.warn(f'{kind}, replaced by that of a homogeneous solid: {_named(links, _MOST_LINKS_NAMED)}')
    total = merged(parts)
    if total.mass_kg < LEAST_KG:
        raise ConfigError(
            f'{tree.where}: given {total.mass_kg:.3g} kg in all links; allowed: <inertial> in a link, such as that of '
            f'the body, with a mass of at least {LEAST_KG:g} kg'
        )
    return total


def _named(names: List[str], most: int) -> str:
    beyond = len(names) - most
    return ', '.join(names[:most]) + (f' and {beyond} more' if beyond > 0 else '')


def _drive_train(
    where: str, pair: WheelPair, plugins: Sequence[DrivePlugin], choices: RobotChoices, seen: Findings
) -> DriveTrain:
    """Return the drive by the user, else by a plausible plugin or the shapes (diameter) and the wheels (separation)."""
    radii_m = [wheel.radius_m for wheel in pair if wheel.radius_m]
    if radii_m and _differ(radii_m[0], radii_m[-1]) > 1e-4:
        seen.warn(
            f'the wheels differ: diameters {2 * radii_m[0]:.5g} m (left) and {2 * radii_m[1]:.5g} m (right) by '
            'their shapes; both are simulated with the nominal one'
        )
    shape_m, shape = 2.0 * float(np.mean(radii_m or 0.0)), next((each.shape for each in pair if each.radius_m), '')
    given_m, source = next(((each.diameter_m, each.source) for each in plugins if each.diameter_m), (0.0, ''))
    diameter_m, origin = (given_m, source) if given_m else (shape_m, shape)
    if shape_m and given_m and _differ(shape_m, given_m) > AGREE:
        if _differ(shape_m, given_m) > MEASURED:
            diameter_m, origin = shape_m, shape
        by = f'{given_m:.5g} m by {source}, {shape_m:.5g} m by the {shape}'
        seen.warn(f'wheel diameter: {by}: {diameter_m:.5g} m is used')
    chosen_m = choices.wheel_diameter.left, choices.wheel_diameter.right
    diameters_m = chosen_m[0] or diameter_m, chosen_m[1] or diameter_m
    if not all(diameters_m):
        raise ConfigError(
            f'{where}: given wheels {pair[0].link!r} and {pair[1].link!r} without a round shape; '
            'allowed: a collision cylinder, sphere or round mesh on the axle, or simulator.wheel_diameter'
        )
    if max(diameters_m) > LARGEST_M:
        seen.warn(f'wheels of {max(diameters_m):.5g} m: a URDF is in metres; are its lengths in mm?')
    both = ' and '.join(dict.fromkeys(f'{each_m:.5g}' for each_m in diameters_m))
    seen.add('wheel diameter [m]', both, 'given' if any(chosen_m) else origin)

    apart_m, origin = pair[0].centre_m[1] - pair[1].centre_m[1], f'{"middles" if radii_m else "joints"} of the wheels'
    given_m, source = next(((each.separation_m, each.source) for each in plugins if each.separation_m), (apart_m, ''))
    if _differ(apart_m, given_m) > AGREE:
        between = f'{apart_m:.5g} m between the {origin}, which is used'
        seen.warn(f'wheel separation: {given_m:.5g} m by {source}, {between}')
    if choices.wheel_separation is not None:
        apart_m, origin = choices.wheel_separation, 'given'
    seen.add('wheel separation [m]', f'{apart_m:.5g}', origin)

    # Moved along the axle to their places at the nominal separation.
    middle_m = 0.5 * (pair[0].centre_m[1] + pair[1].centre_m[1])
    wheels: List[DrivenWheel] = []
    for wheel, half_m, each_m in zip(pair, (0.5 * apart_m, -0.5 * apart_m), diameters_m):
        centre_m = wheel.centre_m[0], middle_m + half_m, wheel.centre_m[2]
        wheels.append(wheel._replace(centre_m=centre_m, radius_m=wheel.radius_m or 0.5 * each_m))
    drive = DriveTrain(wheels[0], wheels[1], diameters_m, apart_m)
    place = f'x = {round(drive.axle_x_m, 6) + 0.0:.4g} m, {1e3 * (drive.floor_z_m + drive.radius_m):.4g} mm up'
    seen.add('axle', place, 'wheels, in the base frame')
    if abs(drive.middle_y_m) > CENTRED_M:
        side = 'left' if drive.middle_y_m > 0.0 else 'right'
        seen.warn(
            f"the wheels' middle is {1e3 * abs(drive.middle_y_m):.1f} mm to the {side} of the base frame's x axis: "
            'odometry, which takes it to be on it, errs by up to twice that in turns'
        )
    return drive


def _differ(a: float, b: float) -> float:
    """Return the relative difference."""
    return abs(a - b) / max(a, b)


def _drive_limits(
    tree: RobotTree,
    drive: DriveTrain,
    plugins: Sequence[DrivePlugin],
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
    for plugin in plugins:
        for key, value in plugin.limits.items():
            by_rim = {f'max_{kind}_acceleration': factor * value for kind, factor in per_rim.items()}
            for name, limit in (by_rim if key == 'rim_acceleration' else {key: value}).items():
                limits.setdefault(name, (limit, plugin.source))
    joints = [tree.joints[wheel.joint] for wheel in (drive.left, drive.right)]
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
        value, source = limits.get(key, (LIMITS[key][1], ''))
        if value > most:
            limits[key] = most, f'{reason} (given by {source}: {value:.4g})' if source else reason

    cut('wheel_torque', mass.mass_kg * G_MPS2 * drive.radius_m, 'mass x g x wheel radius: more only slips')
    grip_mps2, grip_radps2 = grip_accelerations(mass, contacts, drive)
    by_grip = grip_mps2, min(per_rim['angular'] * grip_mps2, grip_radps2)
    by_torque = accelerations(MARGIN * 2.0 * limits['wheel_torque'][0] / drive.radius_m, mass, drive)
    for key, most, by_motors in zip(('max_linear_acceleration', 'max_angular_acceleration'), by_grip, by_torque):
        if key not in limits and by_motors < most:
            cut(key, max(LEAST_ACCELERATION, by_motors), "half of the motors' torque")
        else:
            cut(key, most, "half of the wheels' grip")
    for key, (quantity, usual) in LIMITS.items():
        value, source = limits.get(key, (usual, "this package's default: the robot's file gives none"))
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
    level_mps2, turn_radps2 = accelerations(MARGIN * G_MPS2 * mass.mass_kg * share, mass, drive)
    return level_mps2 / (1.0 + height_m / arm_m), turn_radps2


def accelerations(force_n: float, mass: MassProperties, drive: DriveTrain) -> Tuple[float, float]:
    """Return acceleration [m/s^2], and angular one [rad/s^2] about the axle's middle, by both wheels' force."""
    x_m, y_m = float(mass.com_m[0]) - drive.axle_x_m, float(mass.com_m[1])
    inertia_kgm2 = float(mass.inertia_kgm2[2, 2]) + mass.mass_kg * (x_m**2 + y_m**2)
    return force_n / mass.mass_kg, force_n * 0.5 * drive.wheel_separation_m / inertia_kgm2
