"""The description of a differential drive by its file: wheels, contacts, laser, mass, outline, limits."""

from __future__ import annotations

import functools
from typing import Dict, List, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, ground_contacts, judge_stance
from diff_encoder_sim.robots.description import Findings, RobotChoices, RobotDescription, RobotSource, RobotTree
from diff_encoder_sim.robots.drive_train import drive_limits, find_drive
from diff_encoder_sim.robots.laser_search import find_laser
from diff_encoder_sim.robots.meshes import MeshFinder, primitive_tree, visual_primitives_of
from diff_encoder_sim.robots.package_search import find_mesh
from diff_encoder_sim.robots.solids import (
    MassProperties,
    Shape,
    can_be_of_a_body,
    farthest_m,
    homogeneous,
    merged,
    moved,
    placed,
)
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

_ROUNDING = 0.05  # principal moments of a thin plate, a = b + c, are given with few digits
_MOST_LINKS_NAMED = 3
_MOST_JOINTS_NAMED = 12
LEAST_KG = 1e-3  # of a robot
WORLD_FRAMES = ('map', 'odom')  # the robot's pose in them is published


def describe(source: RobotSource, choices: RobotChoices = RobotChoices()) -> RobotDescription:  # noqa: B008
    """Return the description of a robot by its file, with the user's choices in place of what would be found.

    Raises:
        ConfigError: the file is no robot with two driven wheels on one axle.
    """
    expanded = expansion(source)
    choices = choices._replace(laser_link=choices.laser_link or expanded.laser_link)
    return _describe(expanded.urdf, expanded.notes, source, choices)


@functools.lru_cache(maxsize=32)  # a campaign asks for the same robot in each of its trials
def _describe(urdf: str, notes: Tuple[str, ...], source: RobotSource, choices: RobotChoices) -> RobotDescription:
    tree, seen = parse_urdf(urdf, str(source.file)), Findings()
    for note in notes + tree.notes:
        seen.note(note)
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
    drive, pair, plugins = find_drive(simple, choices, seen)
    mass = robot_mass(simple, find, seen)
    com = ', '.join(f'{round(part, 6) + 0.0:.4g}' for part in mass.com_m.tolist())
    seen.add('mass [kg]', f'{mass.mass_kg:.4g}', '<inertial> of the links')
    seen.add('centre of mass', f'({com}) m', '<inertial> of the links')
    driven_links = {name for wheel in pair for name in simple.subtree(wheel.link)}
    links = [(name, simple.links[name]) for name in simple.poses]
    shapes = [(name, placed(s, simple.poses[name])) for name, link in links for s in link.collisions or link.visuals]
    contacts = ground_contacts(simple, drive, driven_links)
    judge_stance(contacts, drive, float(mass.com_m[0]), seen)
    footprint = footprint_outline([shape for _, shape in shapes], drive.floor_z_m, tree.where)
    x_m, y_m = zip(*footprint)
    extent = f'x from {min(x_m):.3f} to {max(x_m):.3f} m, y from {min(y_m):.3f} to {max(y_m):.3f} m'
    seen.add('footprint', f'{extent}, {len(footprint)} corners', 'collision shapes')
    laser = find_laser(simple, choices.laser_link, seen)
    limits = drive_limits(tree, drive, plugins, mass, contacts, seen)
    still: Dict[str, List[str]] = {}  # joints that do not move in the simulation, by kind
    for joint in tree.joints.values():
        if joint.kind != 'fixed' and joint.name not in (drive.left.joint, drive.right.joint):
            still.setdefault(f'{joint.kind}, mimic' if joint.is_mimic else joint.kind, []).append(joint.name)
    if still:
        kinds = '; '.join(f'{_named(names, _MOST_JOINTS_NAMED)} ({kind})' for kind, names in still.items())
        seen.note(f'joints held still at zero: {kinds}')
    hull = tuple(shape for name, shape in shapes if name not in driven_links)
    found = tuple(seen.found), tuple(seen.warnings), tuple(seen.notes)
    return RobotDescription(**vars(drive), tree=tree, mass=mass, contacts=contacts, hull=hull, footprint=footprint,
                            laser=laser, drive_limits=limits, found=found[0], warnings=found[1],
                            notes=found[2])  # fmt: skip


def robot_mass(tree: RobotTree, find: MeshFinder, seen: Findings) -> MassProperties:
    """Return the mass of all links, absurd inertias replaced by those of homogeneous solids, with a warning each kind.

    Args:
        tree: the robot, collision meshes replaced.
        find: finds the mesh of a visual shape, which stands in if a link has no collision shape.
        seen: takes the warnings.

    Raises:
        ConfigError: the robot has no mass, or one that no robot has.
    """
    # The shapes of all links that are fixed to one another, by link; without any, those of the robot.
    around: Dict[str, List[Shape]] = {}
    everything: List[Shape] = []
    for name, pose in tree.poses.items():
        joint, shapes = tree.above.get(name), [placed(shape, pose) for shape in tree.links[name].collisions]
        around[name] = around[joint.parent] if joint is not None and joint.kind == 'fixed' else []
        around[name] += shapes
        everything += shapes
    parts: List[MassProperties] = []
    faults: Dict[str, List[str]] = {}  # links by kind
    for name, link in tree.links.items():
        mass = link.inertial
        if mass is None:
            continue
        com_m = moved(mass, tree.poses[name]).com_m
        fault = _fault(mass, farthest_m(around[name] or everything, com_m) or np.inf)
        if fault is not None:
            kind, detail = fault
            faults.setdefault(kind, []).append(f'{name} ({detail})')
            solid = homogeneous(link.collisions or visual_primitives_of(link, find), mass.mass_kg)
            mass = mass._replace(inertia_kgm2=solid.inertia_kgm2)
        parts.append(moved(mass, tree.poses[name]))
    for kind, links in faults.items():
        seen.warn(f'{kind}, replaced by that of a homogeneous solid: {_named(links, _MOST_LINKS_NAMED)}')
    total = merged(parts)
    if total.mass_kg < LEAST_KG:
        raise ConfigError(
            f'{tree.where}: given {total.mass_kg:.3g} kg in all links; allowed: <inertial> in a link, such as that of '
            f'the body, with a mass of at least {LEAST_KG:g} kg'
        )
    return total


def _fault(mass: MassProperties, reach_m: float) -> Optional[Tuple[str, str]]:
    """Return kind and detail of what is wrong with the inertia of a mass all within `reach_m` of its centre."""
    moments = np.linalg.eigvalsh(mass.inertia_kgm2)
    shown = 'principal moments ' + ', '.join(f'{moment:.3g}' for moment in moments) + ' kg m^2'
    if moments[0] <= 0:
        return 'an inertia that is not positive', shown
    if not can_be_of_a_body(mass.inertia_kgm2, _ROUNDING):
        return 'an inertia of no body, one principal moment larger than the sum of the others', shown
    gyration_m = float(np.sqrt(moments[2] / mass.mass_kg))
    if gyration_m <= reach_m:
        return None
    detail = f'{moments[2]:.3g} kg m^2 of {mass.mass_kg:.3g} kg: a radius of gyration of {1e3 * gyration_m:.0f} mm'
    return 'an inertia of a body larger than its shapes', f'{detail}, shapes within {1e3 * reach_m:.0f} mm'


def _named(names: List[str], most: int) -> str:
    beyond = len(names) - most
    return ', '.join(names[:most]) + (f' and {beyond} more' if beyond > 0 else '')
