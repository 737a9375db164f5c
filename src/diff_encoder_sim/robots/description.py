"""A robot as found in its files and overridden by its user: source, choices, description, findings."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from diff_encoder_sim.base.xml_values import Vector


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


ADDED_LINK = 'laser'  # with a number, if the URDF has a link of this name


class AddedLaser(NamedTuple):
    """A level scanner on a link of the robot."""

    parent: str  # link
    xyz_m: Vector  # in the parent

    def place(self) -> Dict[str, Any]:
        """Return the entry of a robot file."""
        return {'parent': self.parent, 'xyz': list(self.xyz_m)}


def added_link(urdf: str) -> str:
    """Return the name of the scanner's link in a URDF that does not have it yet."""
    taken = {match[2] for match in re.finditer(r'\sname\s*=\s*(["\'])(.*?)\1', urdf)}
    names = itertools.chain([ADDED_LINK], (f'{ADDED_LINK}_{number}' for number in itertools.count(2)))
    return next(name for name in names if not {name, f'added_{name}_joint'} & taken)


def with_laser(urdf: str, laser: AddedLaser) -> str:
    """Return the URDF with one more link, that of the scanner."""
    link = added_link(urdf)
    end = max(match.start() for match in re.finditer(r'</([\w.-]+:)?robot\s*>', urdf))
    x_m, y_m, z_m = laser.xyz_m
    added = (
        f'<link name="{link}"/>'
        f'<joint name="added_{link}_joint" type="fixed">'
        f'<parent link={quoteattr(laser.parent)}/><child link="{link}"/>'
        f'<origin xyz="{x_m} {y_m} {z_m}" rpy="0 0 0"/>'
        '</joint>'
    )
    return urdf[:end] + added + urdf[end:]


class RobotSource(NamedTuple):
    """A robot's description as users name it: hashable, so that what is made of it can be cached."""

    file: Path  # xacro or URDF
    arguments: Tuple[Tuple[str, str], ...] = ()  # (name, value) of xacro:arg, in any order
    package_folders: Tuple[Path, ...] = ()  # packages, or folders that hold some
    added_laser: Optional[AddedLaser] = None  # None: the scanner is the URDF's


class RobotChoices(NamedTuple):
    """Overrides of describing.describe; None: find out."""

    left_joint: Optional[str] = None
    right_joint: Optional[str] = None
    laser_link: Optional[str] = None
    wheel_diameter: Optional[float] = None  # [m]
    wheel_separation: Optional[float] = None  # [m]


OutlineXy = Tuple[Tuple[float, float], ...]


class Found(NamedTuple):
    """A value and where it comes from, for the table that users read."""

    quantity: str  # such as 'wheel diameter [m]'
    value: str
    source: str  # such as 'libgazebo_ros_diff_drive: wheelDiameter'


class DriveWheel(NamedTuple):
    """A driven wheel."""

    joint: str
    link: str
    centre_m: Vector  # of its rolling circle, in the root
    radius_m: float
    is_forward_positive: bool  # a positive joint speed drives forward; else the joint's axis points to the right


class GroundContact(NamedTuple):
    """A caster, ball, skid or hull edge on which the robot leans."""

    name: str
    point_m: Vector  # the lowest point, in the root


class RobotLaser(NamedTuple):
    """The scanner and what the URDF says of it."""

    link: str
    pose_in_root: np.ndarray  # (4, 4)
    settings: Dict[str, Any]  # keys of LidarParams: samples, angle_min, angle_span, range_min, range_max, noise, rate


class MassProperties(NamedTuple):
    """Mass of the robot or of a part of it, in the root's frame."""

    mass_kg: float
    com_m: np.ndarray  # (3,)
    inertia_kgm2: np.ndarray  # (3, 3), about the centre of mass


class RobotDescription(NamedTuple):
    """A differential-drive robot, ready for physics, odometry and navigation."""

    tree: RobotTree
    left: DriveWheel
    right: DriveWheel
    wheel_diameter_m: float  # nominal, of both: what odometry and controller assume
    wheel_separation_m: float  # between the contact points
    mass: MassProperties  # of all links
    contacts: Tuple[GroundContact, ...]
    hull: Tuple[Shape, ...]  # collision shapes of all but wheels and contacts, poses in the root, meshes replaced
    footprint: OutlineXy  # convex, counter-clockwise, wheels included
    laser: Optional[RobotLaser]
    drive_limits: Dict[str, float]  # keys of DriveParams that plugins and joint limits give
    found: Tuple[Found, ...]
    warnings: Tuple[str, ...]  # what is likely wrong in the URDF, one line each
    notes: Tuple[str, ...]  # what was frozen, replaced or ignored, one line each

    @property
    def axle_x_m(self) -> float:
        """Return the axle's x in the root link."""
        return 0.5 * (self.left.centre_m[0] + self.right.centre_m[0])

    @property
    def floor_z_m(self) -> float:
        """Return the floor's z in the root link: where the wheels touch it."""
        return 0.5 * (self.left.centre_m[2] + self.right.centre_m[2]) - 0.5 * self.wheel_diameter_m


class Findings:
    """The table, the warnings and the notes of a robot, in the order in which they were found."""

    def __init__(self) -> None:
        self.found: List[Found] = []
        self.warnings: List[str] = []
        self.notes: List[str] = []

    def add(self, quantity: str, value: object, source: str) -> None:
        """Add a row to the table."""
        self.found.append(Found(quantity, str(value), source))

    def warn(self, text: str) -> None:
        """Add what is likely wrong in the robot's file, one line."""
        if text not in self.warnings:
            self.warnings.append(text)

    def note(self, text: str) -> None:
        """Add what is done differently from the robot's file, one line."""
        if text not in self.notes:
            self.notes.append(text)
