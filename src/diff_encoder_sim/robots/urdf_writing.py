"""Links and joints as the XML of a URDF."""

from __future__ import annotations

from typing import Dict, Iterable
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.xml_values import rpy_from_rotation
from diff_encoder_sim.robots.robot_description import MassProperties
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Shape, Sphere

DEFAULT_FRICTION = 0.5  # PyBullet's own, with which bodies slide along walls


def add_link(
    robot: ElementTree.Element,
    name: str,
    mass: MassProperties,
    shapes: Iterable[Shape],
    friction: float = DEFAULT_FRICTION,
) -> None:
    """Add a link."""
    link = ElementTree.SubElement(robot, 'link', name=name)
    inertial = ElementTree.SubElement(link, 'inertial')
    ElementTree.SubElement(inertial, 'origin', xyz=_text(mass.com_m))
    ElementTree.SubElement(inertial, 'mass', value=repr(float(mass.mass_kg)))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mass.inertia_kgm2.tolist()
    values = {'ixx': xx, 'ixy': xy, 'ixz': xz, 'iyy': yy, 'iyz': yz, 'izz': zz}
    ElementTree.SubElement(inertial, 'inertia', {key: repr(value) for key, value in values.items()})
    contact = ElementTree.SubElement(link, 'contact')
    ElementTree.SubElement(contact, 'lateral_friction', value=repr(friction))
    for shape in shapes:
        _add_collision(link, shape)


def _add_collision(link: ElementTree.Element, shape: Shape) -> None:
    collision = ElementTree.SubElement(link, 'collision')
    ElementTree.SubElement(collision, 'origin', origin_attributes(shape.pose_in_link))
    geometry = ElementTree.SubElement(collision, 'geometry')
    if isinstance(shape.geometry, Box):
        ElementTree.SubElement(geometry, 'box', size=_text(shape.geometry.size_xyz_m))
    elif isinstance(shape.geometry, Cylinder):
        size = {'radius': repr(shape.geometry.radius_m), 'length': repr(shape.geometry.length_m)}
        ElementTree.SubElement(geometry, 'cylinder', size)
    elif isinstance(shape.geometry, Sphere):
        ElementTree.SubElement(geometry, 'sphere', radius=repr(shape.geometry.radius_m))


def origin_attributes(pose: np.ndarray) -> Dict[str, str]:
    """Return the attributes of an <origin> for a (4, 4) pose."""
    return {'xyz': _text(pose[:3, 3]), 'rpy': _text(rpy_from_rotation(pose[:3, :3]))}


def add_joint(
    robot: ElementTree.Element, name: str, kind: str, parent: str, child: str, origin_m: Iterable[float]
) -> ElementTree.Element:
    """Add a joint whose frame is at `origin_m` in the parent link, and return it."""
    joint = ElementTree.SubElement(robot, 'joint', name=name, type=kind)
    ElementTree.SubElement(joint, 'parent', link=parent)
    ElementTree.SubElement(joint, 'child', link=child)
    ElementTree.SubElement(joint, 'origin', xyz=_text(origin_m))
    return joint


def _text(numbers: Iterable[float]) -> str:
    return ' '.join(repr(float(number)) for number in numbers)
