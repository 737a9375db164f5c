"""A robot as the simulator needs it: what PyBullet loads, and what is known of it."""

from __future__ import annotations

import functools
import re
from typing import NamedTuple, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import Findings, RobotChoices, RobotDescription, RobotSource
from diff_encoder_sim.robots.meshes import MeshFinder, file_corners_m, is_listed, listed_mesh
from diff_encoder_sim.robots.physics_urdf import FLOOR_ONLY_LINKS, TrueWheels, joined_links, physics_urdf, sound_wheels
from diff_encoder_sim.robots.primitive_tree import primitive_tree, without_unread_meshes
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

# Signs that a xacro or URDF depends on more than its own text and arguments: other files, the environment.
_NEEDS_OTHERS = re.compile(r'include|load_yaml|<mesh|\$\((?!arg\b)')


def needs_other_files(text: str) -> bool:
    """Say whether a xacro or URDF may mean something else, or nothing, on another machine."""
    return _NEEDS_OTHERS.search(text) is not None


def self_contained_urdf(urdf: str, where: str, find: MeshFinder) -> str:
    """Return a URDF with the outer corners of its meshes in place of their files' names.

    What is found out about a robot is the same with it as with the meshes. So all collision meshes are written out, and
    the visual meshes of links whose visual shapes count; other visual meshes keep their names. Without any such mesh
    it is the text as it is.

    Args:
        urdf: the XML, xacro expanded.
        where: begins errors: the robot's file.
        find: finds a mesh's file.

    Raises:
        ConfigError: a collision mesh is missing, broken or too large.
    """
    tree = parse_urdf(urdf, where)
    left_out = Findings()
    simple = primitive_tree(without_unread_meshes(tree, find, left_out), find, Findings())
    is_changed = bool(left_out.warnings)
    for link in tree.xml.findall('link'):
        kinds = ('collision', 'visual') if simple.links[link.get('name', '')].visuals else ('collision',)
        meshes = [mesh for kind in kinds for mesh in link.findall(f'{kind}/geometry/mesh')]
        for mesh in meshes:
            is_changed |= _list_corners(mesh, where, find)
    return ElementTree.tostring(tree.xml, encoding='unicode') if is_changed else urdf


def _list_corners(mesh: ElementTree.Element, where: str, find: MeshFinder) -> bool:
    """Put a mesh's corners in place of its file's name; say whether that was needed and possible."""
    uri = mesh.get('filename', '').strip()
    if is_listed(uri):
        return False
    try:
        mesh.set('filename', listed_mesh(uri, file_corners_m(uri, where, find)))
    except ConfigError:  # of a visual mesh: it does not count here either
        return False
    return True


class GeometryErrors(NamedTuple):
    """What the true wheels differ by from the description's, relative."""

    left_radius: float = 0.0
    right_radius: float = 0.0
    separation: float = 0.0

    def applied_to(self, description: RobotDescription) -> TrueWheels:
        """Return the true wheels of a robot."""
        radius_m = 0.5 * description.wheel_diameter_m
        return TrueWheels(
            radius_m * (1.0 + self.left_radius),
            radius_m * (1.0 + self.right_radius),
            description.wheel_separation_m * (1.0 + self.separation),
        )

    def arguments(self) -> Tuple[Tuple[str, str], ...]:
        """Return the errors that are not 0 as xacro arguments, under the names that ALTO's file has for them."""
        named = {
            'wheel_radius_error_left': self.left_radius,
            'wheel_radius_error_right': self.right_radius,
            'wheel_separation_error': self.separation,
        }
        return tuple((name, repr(error)) for name, error in named.items() if error)


NO_ERRORS = GeometryErrors()


class SimulatedRobot(NamedTuple):
    """A robot with its true wheels."""

    description: RobotDescription
    urdf: str  # what PyBullet loads; wheel joints are named as in the description, and positive is forward
    wheels: TrueWheels
    floor_only_links: Tuple[str, ...]  # of that URDF: touch nothing but the floor, which the others do not touch

    @property
    def joints(self) -> Tuple[str, str]:
        """Return the names of the left and the right wheel's joint."""
        return self.description.left.joint, self.description.right.joint

    @property
    def forward_signs(self) -> Tuple[float, float]:
        """Return the signs of the left and the right joint's speed, by the robot's own axes, when it drives forward."""
        left, right = self.description.left, self.description.right
        return 1.0 if left.is_forward_positive else -1.0, 1.0 if right.is_forward_positive else -1.0


def load_simulated_robot(
    source: RobotSource, choices: RobotChoices, errors: GeometryErrors = NO_ERRORS
) -> SimulatedRobot:
    """Read a robot and make its physics right.

    One that is sound keeps its masses and shapes. Errors of its wheels are then those of its own xacro arguments;
    without such arguments, and for all other robots, the wheels of the simulated robot are changed.

    Raises:
        ConfigError: the robot's files are bad, or describe no robot with two driven wheels.
    """
    description = describe(source, choices)
    wheels = errors.applied_to(description)
    sound = _as_it_is(source, description, errors)
    if sound is not None and np.allclose(sound.wheels, wheels, rtol=1e-6, atol=0.0):
        return sound
    return SimulatedRobot(description, physics_urdf(description, wheels), wheels, FLOOR_ONLY_LINKS)


def _as_it_is(source: RobotSource, description: RobotDescription, errors: GeometryErrors) -> Optional[SimulatedRobot]:
    """Return a robot of the file's own URDF; None where that is not sound."""
    declared = expansion(source).declared
    arguments = {**dict(source.arguments), **{name: value for name, value in errors.arguments() if name in declared}}
    urdf = expansion(source._replace(arguments=tuple(arguments.items()))).urdf
    sound = _sound(urdf, str(source.file), description.left.joint, description.right.joint)
    return sound and SimulatedRobot(description, *sound, ())


@functools.lru_cache(maxsize=16)  # trials of a campaign ask again and again
def _sound(urdf: str, where: str, left_joint: str, right_joint: str) -> Optional[Tuple[str, TrueWheels]]:
    """Return what PyBullet loads of a sound URDF, and its wheels; None of another."""
    tree = parse_urdf(urdf, where)
    wheels = sound_wheels(tree, left_joint, right_joint)
    return wheels and (joined_links(tree), wheels)
