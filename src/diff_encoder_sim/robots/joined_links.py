"""A sound URDF with fewer links: the physics moves each on in every step, also those that are fixed to one another."""

from __future__ import annotations

import copy
from typing import Dict, List
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.robots.mass_properties import link_mass, merged
from diff_encoder_sim.robots.robot_tree import Joint, RobotTree
from diff_encoder_sim.robots.solids import placed
from diff_encoder_sim.robots.urdf_writing import DEFAULT_FRICTION, add_joint, add_link, origin_attributes


def joined_links(tree: RobotTree) -> str:
    """Return the URDF of a robot of equal mass, shapes and motion, without visuals.

    Links that are fixed to one another become one for each friction. Root link, moving joints and the frames of their
    links stay. Shapes are those of the tree, in which a capsule is a cylinder; none is a mesh, and each link has a
    mass (`sound_urdf.sound_wheels`).
    """
    robot = ElementTree.Element('robot', name=tree.name)
    moving = [joint for joint in tree.joints.values() if joint.kind != 'fixed']
    parts = [_fixed_to(tree, top) for top in (tree.root, *(joint.child for joint in moving))]
    # Contacts are solved in the order of the joints. With the wheels first truth and wheels of ALTO agree a hundred
    # times better, after as many iterations, than with casters first.
    for joint in moving:
        _add_moving(robot, tree, joint, next(names[0] for names in parts if joint.parent in names))
    for names in parts:
        _add_part(robot, tree, names)
    return ElementTree.tostring(robot, encoding='unicode')


def _fixed_to(tree: RobotTree, top: str) -> List[str]:
    """Return the name of a link and of the links below it that do not move against it."""
    names = [top]
    for name in names:
        names += [joint.child for joint in tree.joints.values() if (joint.parent, joint.kind) == (name, 'fixed')]
    return names


def _add_moving(robot: ElementTree.Element, tree: RobotTree, joint: Joint, parent: str) -> None:
    """Add a joint with all that its file says of it, on another link that its own parent is fixed to."""
    moved = next(copy.deepcopy(element) for element in tree.xml.iterfind('joint') if element.get('name') == joint.name)
    for replaced in (*moved.findall('parent'), *moved.findall('origin')):
        moved.remove(replaced)
    poses = tree.link_poses()
    ElementTree.SubElement(moved, 'parent', link=parent)
    ElementTree.SubElement(moved, 'origin', origin_attributes(np.linalg.inv(poses[parent]) @ poses[joint.child]))
    robot.append(moved)


def _add_part(robot: ElementTree.Element, tree: RobotTree, names: List[str]) -> None:
    """Add a rigid part of links as its first one with all of equal friction, and one more for each other friction."""
    by_friction: Dict[float, List[str]] = {}
    for name in names:
        given = tree.links[name].friction
        by_friction.setdefault(DEFAULT_FRICTION if given is None else given, []).append(name)
    poses = tree.link_poses()
    to_part = np.linalg.inv(poses[names[0]])
    for friction, equal in by_friction.items():
        links = [(tree.links[name], to_part @ poses[name]) for name in equal]
        mass = merged(link_mass(link.inertial, pose) for link, pose in links if link.inertial is not None)
        shapes = [placed(shape, pose) for link, pose in links for shape in link.collisions]
        add_link(robot, equal[0], mass, shapes, friction)
        if equal[0] != names[0]:
            above = tree.joint_above(equal[0])
            assert above is not None  # only the root has none, which is the first of its part
            add_joint(robot, above.name, 'fixed', names[0], equal[0], np.zeros(3))
