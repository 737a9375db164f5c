"""A robot with boxes, cylinders and balls in place of its meshes: what this room measures."""

from __future__ import annotations

import re
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import CASTER_NAMES
from diff_encoder_sim.robots.description import Findings
from diff_encoder_sim.robots.meshes import (
    MeshFinder,
    file_corners_m,
    link_corners_m,
    primitives_of,
    visual_primitives_of,
)
from diff_encoder_sim.robots.robot_tree import Cylinder, Joint, Link, Mesh, RobotTree, Shape, Sphere
from diff_encoder_sim.robots.rolling_wheels import UPRIGHT, rigid_links, spins
from diff_encoder_sim.robots.solids import placed

RIM = 0.98  # of the radius: what is farther out rolls
LARGEST_GAP_RAD = 1.2  # between points of the rim, seen from the axle: a hexagon is round, a box is not
NARROWEST_M = 1e-3


def mesh_treads(tree: RobotTree, joint: Joint, link: str, find: MeshFinder, visual: bool) -> Iterator[Shape]:
    """Yield the treads of a link's meshes about a joint that turns it, each a cylinder in the link.

    Args:
        tree: the robot as parsed.
        joint: what turns the link.
        link: the joint's child, or a link fixed to it.
        find: finds a mesh's file.
        visual: whether to look at visual rather than collision meshes; those that cannot be read are left out then.

    Raises:
        ConfigError: a collision mesh cannot be read.
    """
    poses = tree.link_poses()
    to_link = np.linalg.inv(poses[link]) @ poses[joint.child]
    part = tree.links[link]
    for shape in part.visuals if visual else part.collisions:
        try:
            points_m = points_in_link_m(shape, find, f'{tree.where}: link {link!r}')
        except ConfigError:
            if not visual:
                raise
            continue
        tread = None if points_m is None else tread_of(points_m, to_link[:3, 3], to_link[:3, :3] @ joint.axis)
        if tread is not None:
            yield tread


def points_in_link_m(shape: Shape, find: MeshFinder, where: str) -> Optional[np.ndarray]:
    """Return the (n, 3) outer points of a mesh in its link; None of another shape.

    Raises:
        ConfigError: the mesh is missing or cannot be read.
    """
    return link_corners_m(shape, where, find) if isinstance(shape.geometry, Mesh) else None


def tread_of(points_m: np.ndarray, centre_m: np.ndarray, axis: np.ndarray) -> Optional[Shape]:
    """Return the cylinder on which (n, 3) points roll about an axis (3,) through a point (3,); None if not round."""
    across, up = _perpendiculars(axis)
    from_axle_m = points_m - centre_m
    along_m = from_axle_m @ axis
    x_m, y_m = from_axle_m @ across, from_axle_m @ up
    radii_m = np.hypot(x_m, y_m)
    rim = radii_m > RIM * radii_m.max()
    bearings_rad = np.sort(np.arctan2(y_m[rim], x_m[rim]))
    if np.diff(bearings_rad, append=bearings_rad[0] + 2.0 * np.pi).max() > LARGEST_GAP_RAD:
        return None
    low_m, high_m = float(along_m[rim].min()), float(along_m[rim].max())
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([across, up, axis])
    pose[:3, 3] = centre_m + 0.5 * (low_m + high_m) * axis
    return Shape(Cylinder(round(float(radii_m.max()), 6), max(high_m - low_m, NARROWEST_M)), pose)


def _perpendiculars(axis: np.ndarray) -> np.ndarray:
    """Return two (3,) unit vectors that make a right-handed frame with an axis as its third."""
    across = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(axis, across)])


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


class BodyShape(NamedTuple):
    """A shape in the root, with its link."""

    link: str
    shape: Shape


def primitive_tree(tree: RobotTree, find: MeshFinder, seen: Findings) -> RobotTree:
    """Return the robot with its collision meshes replaced, and visual shapes only where they are needed.

    Visual meshes are large, and say less: they stand in for a wheel that has no round collision shape, for a caster
    that has none, and for a robot that has none at all.

    Raises:
        ConfigError: a collision mesh is missing, broken or too large.
    """
    links: Dict[str, Link] = {}
    for name, link in tree.links.items():
        shapes, notes = primitives_of(link, tree.where, find)
        links[name] = link._replace(collisions=shapes, visuals=())
        for note in notes:
            seen.note(note)
    wheels = _add_treads(tree, links, find)
    has_body = any(links[name].collisions for name in links if name not in wheels)
    if not has_body:
        seen.warn('no link but the wheels has a collision shape: visual shapes are taken')
    for name, link in links.items():
        if not link.visuals and (not has_body or (CASTER_NAMES.search(name) and not link.collisions)):
            links[name] = link._replace(visuals=visual_primitives_of(tree.links[name], find))
    return tree._replace(links=links)


def _add_treads(tree: RobotTree, links: Dict[str, Link], find: MeshFinder) -> Set[str]:
    """Add treads to the wheels' meshes, and visual shapes to wheels that are not round; return the wheels' links."""
    wheels: Set[str] = set()
    for joint in tree.joints.values():
        for name in rigid_links(tree, joint.child) if spins(tree, joint) else ():
            link = links[name]
            link = link._replace(collisions=(*link.collisions, *mesh_treads(tree, joint, name, find, visual=False)))
            if not _is_round(link):
                shapes = visual_primitives_of(tree.links[name], find)
                link = link._replace(visuals=(*shapes, *mesh_treads(tree, joint, name, find, visual=True)))
            links[name] = link
            wheels.add(name)
    return wheels


def collision_shapes(tree: RobotTree) -> Dict[str, Tuple[Shape, ...]]:
    """Return each link's collision shapes, in the link."""
    return {name: link.collisions for name, link in tree.links.items()}


def mesh_points_m(tree: RobotTree, find: MeshFinder, link: str, number: int) -> Optional[np.ndarray]:
    """Return the (n, 3) outer points of a link's collision mesh in the link; None where that shape is no mesh."""
    shapes = tree.links[link].collisions
    return points_in_link_m(shapes[number], find, tree.where) if number < len(shapes) else None


def body_shapes(tree: RobotTree, poses: Mapping[str, np.ndarray]) -> List[BodyShape]:
    """Return the shapes of all links in the root: collision shapes, or visual ones where a link has none."""
    return [
        BodyShape(name, placed(shape, pose))
        for name, pose in poses.items()
        for shape in tree.links[name].collisions or tree.links[name].visuals
    ]


def _is_round(link: Link) -> bool:
    return any(isinstance(shape.geometry, (Cylinder, Sphere)) for shape in link.collisions)
