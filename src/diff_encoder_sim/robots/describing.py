"""Find out what a robot's file says of a differential drive: wheels, contacts, laser, mass, outline, limits."""

from __future__ import annotations

import functools
from typing import Dict, List, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, ground_contacts, judge_stance
from diff_encoder_sim.robots.description import (
    Findings,
    MassProperties,
    OutlineXy,
    RobotChoices,
    RobotDescription,
    RobotSource,
)
from diff_encoder_sim.robots.drive_train import drive_limits, find_drive
from diff_encoder_sim.robots.laser_search import find_laser
from diff_encoder_sim.robots.meshes import MeshFinder
from diff_encoder_sim.robots.package_search import find_mesh
from diff_encoder_sim.robots.primitive_tree import (
    body_shapes,
    collision_shapes,
    mesh_points_m,
    primitive_tree,
    without_unread_meshes,
)
from diff_encoder_sim.robots.robot_tree import Joint, RobotTree
from diff_encoder_sim.robots.rolling_wheels import WheelPair
from diff_encoder_sim.robots.sound_inertias import link_masses
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

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
    contacts = ground_contacts(simple, drive.base, lambda link, number: mesh_points_m(tree, find, link, number))
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
