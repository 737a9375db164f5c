"""A robot's links and joints as values: what the rest of this room works on.

Made by urdf_parsing.parse_urdf. Lengths in m, masses in kg, angles in rad; a pose is a (4, 4) homogeneous matrix.
"""

from __future__ import annotations

from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple, Union
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.text_values import Vector


class Box(NamedTuple):
    """A cuboid, centred on its pose."""

    size_xyz_m: Vector


class Cylinder(NamedTuple):
    """A cylinder along z, centred on its pose; a URDF capsule is one, too."""

    radius_m: float
    length_m: float


class Sphere(NamedTuple):
    """A ball, centred on its pose."""

    radius_m: float


class Mesh(NamedTuple):
    """A mesh in a file, as the URDF names it."""

    uri: str  # package://, file://, or a path relative to the robot's file
    scale_xyz: Vector


Geometry = Union[Box, Cylinder, Sphere, Mesh]


class Shape(NamedTuple):
    """A visual or collision shape of a link."""

    geometry: Geometry
    pose_in_link: np.ndarray  # (4, 4)


class Inertial(NamedTuple):
    """Mass of a link."""

    mass_kg: float
    com_in_link_m: np.ndarray  # (3,)
    inertia_kgm2: np.ndarray  # (3, 3), about the centre of mass, along the link's axes


class Link(NamedTuple):
    """A rigid part."""

    name: str
    inertial: Optional[Inertial]
    collisions: Tuple[Shape, ...]
    visuals: Tuple[Shape, ...]
    friction: Optional[float]  # of <contact><lateral_friction>, PyBullet's tag; None where it is not given


class Joint(NamedTuple):
    """What holds a link to its parent."""

    name: str
    kind: str  # fixed, continuous, revolute, prismatic, floating, planar
    parent: str
    child: str
    child_in_parent: np.ndarray  # (4, 4), at zero
    axis: np.ndarray  # (3,) unit vector in the child's frame
    effort: Optional[float]  # limit [N m], None where it is not given
    speed: Optional[float]  # limit [rad/s]
    is_mimic: bool


class RobotTree(NamedTuple):
    """A robot as its URDF describes it: links hung below one root link."""

    name: str
    root: str  # the root link's name: the robot's base frame
    links: Dict[str, Link]
    joints: Dict[str, Joint]  # by the joint's name
    xml: ElementTree.Element  # <robot>: for <gazebo>, <transmission> and <ros2_control>
    where: str  # the robot's file, which begins each error
    notes: Tuple[str, ...] = ()  # what was ignored, one line each

    def joint_above(self, link: str) -> Optional[Joint]:
        """Return the joint that a link hangs on; None for the root."""
        return next((joint for joint in self.joints.values() if joint.child == link), None)

    def link_poses(self) -> Dict[str, np.ndarray]:
        """Return each link's (4, 4) pose in the root link, joints at zero; parents before children."""
        poses = {self.root: np.eye(4)}
        below: Dict[str, List[Joint]] = {}
        for joint in self.joints.values():
            below.setdefault(joint.parent, []).append(joint)
        open_links = [self.root]
        while open_links:
            parent = open_links.pop()
            for joint in below.get(parent, []):
                poses[joint.child] = poses[parent] @ joint.child_in_parent
                open_links.append(joint.child)
        return poses

    def subtree(self, link: str) -> Iterator[str]:
        """Yield a link's name and those of all links below it."""
        open_links = [link]
        while open_links:
            name = open_links.pop()
            yield name
            below = [joint.child for joint in self.joints.values() if joint.parent == name]
            open_links += reversed(below)
