"""A robot's URDF without other files: what Dask workers get."""

from __future__ import annotations

import re
from typing import Dict, Iterable, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.xml_values import rpy_from_rotation
from diff_encoder_sim.robots.mesh_hulls import MeshFinder, mesh_hull
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Mesh, Shape, Sphere
from diff_encoder_sim.robots.urdf_parsing import parse_urdf

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
    tree = parse_urdf(urdf, where)
    has_meshes = False
    for element in tree.xml.findall('link'):
        link = tree.links[element.get('name', '')]
        meshes = [shape for shape in link.collisions if isinstance(shape.geometry, Mesh)]
        has_meshes = has_meshes or bool(meshes)
        collisions = [each for each in element.findall('collision') if each.find('geometry/mesh') is not None]
        for collision, shape in zip(collisions, meshes):
            _put(mesh_hull(shape, f'{where}: link {link.name!r}', find), collision)
    return ElementTree.tostring(tree.xml, encoding='unicode') if has_meshes else urdf


def _put(hull: Shape, collision: ElementTree.Element) -> None:
    """Make a primitive the shape of a <collision>."""
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
