"""A robot's URDF without other files: what Dask workers get."""

from __future__ import annotations

import re
from typing import Dict, Iterable, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.xml_values import joint_origin, parse_numbers, rotation_from_rpy, rpy_from_rotation
from diff_encoder_sim.robots.mesh_hulls import MeshFinder, mesh_hull
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Mesh, Shape, Sphere

# Signs that a xacro or URDF depends on more than its own text and arguments: other files, the environment.
_NEEDS_OTHERS = re.compile(r'include|load_yaml|<mesh|\$\((?!arg\b)')


def needs_other_files(text: str) -> bool:
    """Say whether a xacro or URDF may mean something else, or nothing, on another machine."""
    return _NEEDS_OTHERS.search(text) is not None


def self_contained_urdf(urdf: str, where: str, find: MeshFinder) -> str:
    """Return a URDF with collision meshes replaced by boxes, cylinders and balls; without any, the text as it is.

    Visual meshes stay: only RViz looks at them.

    Args:
        urdf: the XML, xacro expanded.
        where: begins errors: the robot's file.
        find: finds a mesh's file.

    Raises:
        ConfigError: a mesh is missing, broken or too large.
    """
    robot = ElementTree.fromstring(urdf.strip())
    meshes = [
        (link.get('name', ''), collision)
        for link in robot.findall('link')
        for collision in link.findall('collision')
        if collision.find('geometry/mesh') is not None
    ]
    for name, collision in meshes:
        _replace_mesh(collision, f'{where}: link {name!r}: collision mesh', find)
    return ElementTree.tostring(robot, encoding='unicode') if meshes else urdf


def _replace_mesh(collision: ElementTree.Element, where: str, find: MeshFinder) -> None:
    """Put the mesh's hull in its place, in a <collision>."""
    mesh = collision.find('geometry/mesh')
    assert mesh is not None
    uri = mesh.get('filename', '')
    scale_x, scale_y, scale_z = parse_numbers(mesh.get('scale', '1 1 1'), 3, f'{where} {uri!r} scale')
    origin = joint_origin(collision, f'{where} {uri!r}: ')
    pose = np.eye(4)
    pose[:3, :3] = rotation_from_rpy(*origin.rpy_rad)
    pose[:3, 3] = origin.xyz_m
    hull = mesh_hull(Shape(Mesh(uri, (scale_x, scale_y, scale_z)), pose), f'{where} {uri!r}', find)
    for child in [*collision.findall('origin'), *collision.findall('geometry')]:
        collision.remove(child)
    rpy_rad = rpy_from_rotation(hull.pose_in_link[:3, :3])
    ElementTree.SubElement(collision, 'origin', xyz=_text(hull.pose_in_link[:3, 3]), rpy=_text(rpy_rad))
    tag, attributes = _element(hull.geometry)
    ElementTree.SubElement(ElementTree.SubElement(collision, 'geometry'), tag, attributes)


def _element(geometry: Geometry) -> Tuple[str, Dict[str, str]]:
    """Return the URDF tag and attributes of a primitive."""
    if isinstance(geometry, Box):
        return 'box', {'size': _text(geometry.size_xyz_m)}
    if isinstance(geometry, Cylinder):
        return 'cylinder', {'radius': repr(geometry.radius_m), 'length': repr(geometry.length_m)}
    assert isinstance(geometry, Sphere)
    return 'sphere', {'radius': repr(geometry.radius_m)}


def _text(numbers: Iterable[float]) -> str:
    """Return numbers as XML text, all digits."""
    return ' '.join(repr(float(number)) for number in numbers)
