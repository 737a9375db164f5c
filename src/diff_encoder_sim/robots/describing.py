"""Find out what a robot's file says of a differential drive: wheels, contacts, laser, mass, outline, limits."""

from __future__ import annotations

import functools
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, ground_contacts, judge_stance
from diff_encoder_sim.robots.description import (
    Findings,
    Inertial,
    Joint,
    MassProperties,
    OutlineXy,
    RobotChoices,
    RobotDescription,
    RobotSource,
    RobotTree,
    Shape,
)
from diff_encoder_sim.robots.drive_train import drive_limits, find_drive
from diff_encoder_sim.robots.laser_search import find_laser
from diff_encoder_sim.robots.meshes import (
    MeshFinder,
    body_shapes,
    collision_shapes,
    primitive_tree,
    shape_points_m,
    visual_primitives_of,
    without_unread_meshes,
)
from diff_encoder_sim.robots.package_search import find_mesh
from diff_encoder_sim.robots.rolling_wheels import WheelPair
from diff_encoder_sim.robots.solids import farthest_m, homogeneous, link_mass, merged, placed
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

# Principal moments of a thin plate, a = b + c, come with few digits.
_ROUNDING = 0.05
_MOST_NAMED = 3
LEAST_KG = 1e-3  # of a robot: bounded_numbers allows wheels of 1 mm

LinkShapes = Mapping[str, Tuple[Shape, ...]]


class LinkMasses(NamedTuple):
    """What each link weighs."""

    by_link: Dict[str, MassProperties]  # in the root's frame, joints at zero; links without mass are left out
    warnings: Tuple[str, ...]  # a line for each kind of inertia that was replaced

    @property
    def total(self) -> MassProperties:
        """Return the mass of the robot."""
        return merged(self.by_link.values())


class _Fault(NamedTuple):
    """Why no body has an inertia."""

    kind: str
    detail: str


def link_masses(tree: RobotTree, shapes: LinkShapes, find: MeshFinder) -> LinkMasses:
    """Return all links' masses, absurd inertias replaced by those of homogeneous solids.

    Args:
        tree: the robot.
        shapes: each link's collision shapes, meshes replaced, in the link.
        find: finds the mesh of a visual shape, which stands in where a link has no collision shape.

    Raises:
        ConfigError: the robot has no mass, or one that no robot has.
    """
    poses = tree.link_poses()
    around = _shapes_around(tree, poses, shapes)
    by_link: Dict[str, MassProperties] = {}
    faults: Dict[str, _Fault] = {}
    for name, link in tree.links.items():
        if link.inertial is None or link.inertial.mass_kg <= 0:
            continue
        inertial = link.inertial
        com_m = link_mass(inertial, poses[name]).com_m
        fault = _fault(inertial, farthest_m(around[name], com_m) or np.inf)
        if fault is not None:
            faults[name] = fault
            solid = homogeneous(shapes[name] or visual_primitives_of(link, find), inertial.mass_kg)
            inertial = inertial._replace(inertia_kgm2=solid.inertia_kgm2)
        by_link[name] = link_mass(inertial, poses[name])
    if not by_link:
        raise ConfigError(
            f'{tree.where}: given no link with a mass; allowed: <inertial> with a mass greater than 0 in a link, '
            'such as that of the body'
        )
    masses = LinkMasses(by_link, tuple(_in_words(faults)))
    if masses.total.mass_kg < LEAST_KG:
        given = f'given {masses.total.mass_kg:.3g} kg in all links'
        raise ConfigError(f'{tree.where}: {given}; allowed: a robot of at least {LEAST_KG:g} kg')
    return masses


def _fault(inertial: Inertial, reach_m: float) -> Optional[_Fault]:
    """Return what is wrong with the inertia of a mass all within `reach_m` of its centre; None if nothing is."""
    moments = np.linalg.eigvalsh(inertial.inertia_kgm2)
    shown = 'principal moments ' + ', '.join(f'{moment:.3g}' for moment in moments) + ' kg m^2'
    if moments[0] <= 0:
        return _Fault('an inertia that is not positive', shown)
    if moments[0] + moments[1] < (1 - _ROUNDING) * moments[2]:
        return _Fault('an inertia of no body, one principal moment larger than the sum of the others', shown)
    gyration_m = float(np.sqrt(moments[2] / inertial.mass_kg))
    if gyration_m > reach_m:
        return _Fault(
            'an inertia of a body larger than its shapes',
            f'{moments[2]:.3g} kg m^2 of {inertial.mass_kg:.3g} kg: a radius of gyration of {1e3 * gyration_m:.0f} mm, '
            f'shapes within {1e3 * reach_m:.0f} mm',
        )
    return None


def _in_words(faults: Mapping[str, _Fault]) -> Iterator[str]:
    """Yield a line for each kind of fault, with the first of its links."""
    for kind in dict.fromkeys(fault.kind for fault in faults.values()):
        links = [f'{link} ({fault.detail})' for link, fault in faults.items() if fault.kind == kind]
        more = len(links) - _MOST_NAMED
        named = ', '.join(links[:_MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
        yield f'{kind}, replaced by that of a homogeneous solid: {named}'


def _shapes_around(tree: RobotTree, poses: Mapping[str, np.ndarray], shapes: LinkShapes) -> Dict[str, List[Shape]]:
    """Return, by link, the shapes of all links that are fixed to it, and its own, in the root; else those of all."""
    joints = {joint.child: joint for joint in tree.joints.values()}
    around: Dict[str, List[Shape]] = {}
    for name, pose in poses.items():
        joint = joints.get(name)
        around[name] = around[joint.parent] if joint is not None and joint.kind == 'fixed' else []
        around[name] += [placed(shape, pose) for shape in shapes[name]]
    everything = [placed(shape, pose) for name, pose in poses.items() for shape in shapes[name]]
    return {name: found or everything for name, found in around.items()}


MOST_NAMES = 12
WORLD_FRAMES = ('map', 'odom')  # the robot's place in them is what is published


def describe(source: RobotSource, choices: RobotChoices = RobotChoices()) -> RobotDescription:  # noqa: B008
    """Return what a robot's file says, with the user's choices in place of what would be found.

    Raises:
        ConfigError: the file is no robot with two driven wheels on one axle.
    """
    expanded = expansion(source)
    choices = choices._replace(laser_link=choices.laser_link or expanded.laser_link)
    return _describe(expanded.urdf, expanded.notes, source, choices)


# A campaign asks for the same robot in each of its trials.
@functools.lru_cache(maxsize=32)
def _describe(
    urdf: str, expansion_notes: Tuple[str, ...], source: RobotSource, choices: RobotChoices
) -> RobotDescription:
    tree, seen = parse_urdf(urdf, str(source.file)), Findings()
    for note in expansion_notes + tree.notes:
        seen.note(note)

    return describe_tree(tree, lambda uri: find_mesh(uri, source), choices, seen)


def describe_tree(tree: RobotTree, find: MeshFinder, choices: RobotChoices, seen: Findings) -> RobotDescription:
    """Return what is known of a robot whose URDF is parsed; see `describe`."""
    _check_root(tree)
    seen.add('name', tree.name, '<robot name>')
    seen.add('base frame', tree.root, 'root link')
    tree = without_unread_meshes(tree, find, seen)
    simple = primitive_tree(tree, find, seen)
    drive = find_drive(simple, choices, seen)
    mass = _mass(simple, find, seen)
    shapes = body_shapes(simple, simple.link_poses())
    hull = [(name, shape) for name, shape in shapes if name not in drive.base.links]
    contacts = ground_contacts(simple, drive.base, lambda link, number: shape_points_m(tree, find, link, number))
    judge_stance(contacts, drive.base, float(mass.com_m[0]), seen)
    footprint = footprint_outline([shape for _, shape in shapes], drive.base.floor_z_m, tree.where)
    seen.add('footprint', _extent(footprint), 'collision shapes')
    laser = find_laser(simple, choices.laser_link, seen)
    limits = drive_limits(tree, drive, mass, contacts, seen)
    _note_frozen(tree, drive.pair, seen)
    return RobotDescription(
        tree,
        drive.left,
        drive.right,
        *drive.geometry,
        mass,
        contacts,
        tuple(shape for _, shape in hull),
        footprint,
        laser,
        limits,
        tuple(seen.found),
        tuple(seen.warnings),
        tuple(seen.notes),
    )


def _check_root(tree: RobotTree) -> None:
    if tree.root in WORLD_FRAMES:
        raise ConfigError(
            f'{tree.where}: root link {tree.root!r} is the name of a frame that others publish; '
            "allowed: the robot's base as root, such as base_link"
        )


def _mass(tree: RobotTree, find: MeshFinder, seen: Findings) -> MassProperties:
    """Return the mass of all links."""
    masses = link_masses(tree, collision_shapes(tree), find)
    for warning in masses.warnings:
        seen.warn(warning)
    mass = masses.total
    com = ', '.join(f'{round(part, 6) + 0.0:.4g}' for part in mass.com_m.tolist())
    seen.add('mass [kg]', f'{mass.mass_kg:.4g}', '<inertial> of the links')
    seen.add('centre of mass', f'({com}) m', '<inertial> of the links')
    return mass


def _extent(outline: OutlineXy) -> str:
    x_m, y_m = zip(*outline)
    return (
        f'x from {min(x_m):.3f} to {max(x_m):.3f} m, y from {min(y_m):.3f} to {max(y_m):.3f} m, {len(outline)} corners'
    )


def _note_frozen(tree: RobotTree, pair: WheelPair, seen: Findings) -> None:
    """Note the joints that do not move in the simulation, by kind."""
    by_kind: Dict[str, List[str]] = {}
    for joint in tree.joints.values():
        if joint.kind != 'fixed' and joint.name not in pair.joints:
            by_kind.setdefault(_kind(joint), []).append(joint.name)
    if by_kind:
        kinds = '; '.join(f'{_listed(names)} ({kind})' for kind, names in by_kind.items())
        seen.note(f'joints held still at zero: {kinds}')


def _kind(joint: Joint) -> str:
    return f'{joint.kind}, mimic' if joint.is_mimic else joint.kind


def _listed(names: Sequence[str]) -> str:
    beyond = len(names) - MOST_NAMES
    return ', '.join(names[:MOST_NAMES]) + (f' and {beyond} more' if beyond > 0 else '')
