"""Collision meshes that are missing or broken, of parts that do not decide how a robot drives: housings of sensors."""

from __future__ import annotations

import re
from typing import Dict, Set, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.mesh_corners import MeshFinder, file_corners_m
from diff_encoder_sim.robots.robot_tree import Link, Mesh, RobotTree, Shape
from diff_encoder_sim.robots.rolling_wheels import UPRIGHT, spins

LARGEST_MASS = 0.2  # of the robot's mass: a heavier part is its body
_ON_THE_FLOOR = re.compile('cast[eo]r|ball|skid|wheel|roller|slider|foot', re.IGNORECASE)

_Faults = Dict[str, str]  # by the mesh's URI


def without_unread_meshes(tree: RobotTree, find: MeshFinder, seen: Findings) -> RobotTree:
    """Return the robot without the collision meshes of accessories that cannot be read, each with a warning.

    They are removed from the tree's XML, too. Meshes of wheels, casters and the body stay: there they are errors.
    """
    unread = {
        name: faults for name, faults in ((name, _faults(link, find)) for name, link in tree.links.items()) if faults
    }
    if not unread:
        return tree
    parts, carriers = _wheel_links(tree)
    masses_kg = {name: link.inertial.mass_kg for name, link in tree.links.items() if link.inertial is not None}
    body_kg = LARGEST_MASS * sum(masses_kg.values())
    for name in list(unread):
        if name in parts | carriers or masses_kg.get(name, 0.0) > body_kg or _ON_THE_FLOOR.search(name):
            del unread[name]
    links = {
        name: link._replace(
            collisions=tuple(each for each in link.collisions if _uri(each) not in unread.get(name, {}))
        )
        for name, link in tree.links.items()
    }
    if not any(link.collisions for name, link in links.items() if name not in parts):
        return tree  # nothing else has a shape
    for name, faults in unread.items():
        for uri, fault in faults.items():
            seen.warn(f'collision mesh {uri!r} of link {name!r} is left out: {fault}')
    for element in tree.xml.findall('link'):
        for collision in element.findall('collision'):
            mesh = collision.find('geometry/mesh')
            if mesh is not None and mesh.get('filename', '').strip() in unread.get(element.get('name', ''), {}):
                element.remove(collision)
    return tree._replace(links=links)


def _faults(link: Link, find: MeshFinder) -> _Faults:
    found: _Faults = {}
    for uri in filter(None, map(_uri, link.collisions)):
        try:
            file_corners_m(uri, '', find)
        except ConfigError as error:
            found[uri] = str(error).lstrip(': ')
    return found


def _uri(shape: Shape) -> str:
    return shape.geometry.uri if isinstance(shape.geometry, Mesh) else ''


def _wheel_links(tree: RobotTree) -> Tuple[Set[str], Set[str]]:
    """Return the links that are wheels or parts of them, and the links that carry these, the root included."""
    poses, above = tree.link_poses(), {joint.child: joint for joint in tree.joints.values()}
    parts: Set[str] = set()
    carriers = {tree.root}
    for name in list(poses)[1:]:  # parents first
        joint = above[name]
        is_level = abs((poses[name][:3, :3] @ joint.axis)[2]) <= UPRIGHT
        if joint.parent in parts or (is_level and spins(tree, joint)):
            parts.add(name)
    for name in reversed(list(poses)[1:]):
        if name in parts | carriers:
            carriers.add(above[name].parent)
    return parts, carriers
