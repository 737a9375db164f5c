"""A robot with boxes, cylinders and balls in place of its meshes: what this room measures."""

from __future__ import annotations

from typing import Dict, List, Mapping, NamedTuple, Optional, Set, Tuple

import numpy as np

from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.ground_contacts import CASTER_NAMES
from diff_encoder_sim.robots.mesh_corners import MeshFinder
from diff_encoder_sim.robots.mesh_hulls import primitives_of, visual_primitives_of
from diff_encoder_sim.robots.robot_tree import Cylinder, Link, RobotTree, Shape, Sphere
from diff_encoder_sim.robots.rolling_wheels import rigid_links, spins
from diff_encoder_sim.robots.solids import placed
from diff_encoder_sim.robots.wheel_treads import mesh_treads, points_in_link_m


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
